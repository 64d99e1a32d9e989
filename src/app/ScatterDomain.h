#pragma once

#include "curlew/app/Session.h"

namespace curlew::app {

/// Where points are wanted: what box= and grid= ask for, else the domain of the newest flow, shape or level set.
Domain scatterDomain(Session& s, const Arguments& a);

} // namespace curlew::app
