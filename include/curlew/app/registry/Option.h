// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

namespace curlew::app {

enum class OptionType {
    flag,        ///< 0 or 1
    integer,     ///< a whole number; 1e6 is one
    real,        ///< a finite number
    length,      ///< a finite number of world units; or 5%, a part of the diagonal of the box of what the action takes
    vector,      ///< x,y,z; or one number for all three
    coordinates, ///< a number for each of 1 to 7 axes; or one for all of them
    interval,    ///< lower,upper
    box,         ///< xmin,ymin,zmin,xmax,ymax,zmax
    choice,      ///< one of a list of words
    text,        ///< anything
    ages,        ///< positions on a stack, 0 the newest: 0 or 0,2. Resolved to links when the graph is made.
};

/// One option of an action, declared once: the parser, the help, the documentation and the nodes of hosts are made from
/// it.
struct Option {
    std::string name = {};
    OptionType type = OptionType::real;
    std::string fallback = {}; ///< The default, as one would type it; "" if there is none.
    std::string help = {};
    std::string unit = {};
    std::vector<std::string> choices = {};
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
    bool exclusive = false;                ///< The lower bound itself is not allowed.
    std::vector<std::string> instead = {}; ///< Options that have no effect beside this one: giving both is an error.
    /// Values that other options have beside this one unless they are given; with expressions.
    std::map<std::string, std::string> implied = {};
    /// With it the action makes a value of its inputs and of the moment: it does not advance with the frames.
    bool timeless = false;
    /// It only selects what the action takes from the stacks. A graph has links instead.
    bool selects = false;
    std::vector<std::string> formerly = {}; ///< Names that it had in the last release: still taken, but not shown.
};

/// The words that an action takes beside its options: `minimum` to `maximum` of them (file names).
struct Positional {
    std::string what = {};
    size_t minimum = 0, maximum = 0;
};

} // namespace curlew::app
