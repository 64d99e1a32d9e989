#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Dfvn.h"

#include <filesystem>

namespace curlew::app {

/// Positions from a CSV file with the header x,y,z. Throws FileError, naming file and line, for anything else.
std::vector<Vec3d> readPositions(const std::filesystem::path& path);

/// Writes x,y,z,value[,dx,dy,dz[,dxx,dyy,dzz,dxy,dxz,dyz]] for derivatives up to `order` (0 … 2), evaluated as T (float
/// or double) and printed with all digits that tell two numbers apart: 9 for float, 17 for double (and for x, y, z).
template <class T>
void probeField(const ScalarField& field, const std::vector<Vec3d>& positions, int order,
                const std::filesystem::path& path, const Monitor& monitor = {});

/// Writes x,y,z,vx,vy,vz,f,g likewise; with order 2, also the velocity's Jacobian by rows, dvx_dx … dvz_dz, which
/// is computed in double.
template <class T>
void probeFlow(const Dfvn& flow, const std::vector<Vec3d>& positions, int order, const std::filesystem::path& path,
               const Monitor& monitor = {});

} // namespace curlew::app
