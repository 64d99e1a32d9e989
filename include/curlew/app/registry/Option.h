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
    length,      ///< a finite number of world units; or 5%, relative to the diagonal of the input's bounding box
    vector,      ///< x,y,z; or one number for all three
    coordinates, ///< a number for each of 1 to 7 axes; or one for all of them
    interval,    ///< lower,upper
    box,         ///< xmin,ymin,zmin,xmax,ymax,zmax
    choice,      ///< one of a list of words
    text,        ///< anything
    ages,        ///< stack positions, 0 the newest: 0 or 0,2. Resolved to links when the graph is built.
};

/// One option of an action, declared once. The parser, the help, the documentation and the hosts' nodes are generated
/// from it.
struct Option {
    std::string name = {};
    OptionType type = OptionType::real;
    std::string fallback = {}; ///< The default as text; "" if there is none.
    std::string help = {};
    std::string unit = {};
    std::vector<std::string> choices = {};
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
    bool exclusive = false; ///< The lower bound itself is not allowed.
    /// Options that have no effect if this one is given. Giving both is an error.
    std::vector<std::string> instead = {};
    /// Conditions, of which one must hold for this option to have an effect: "iso=", another option that must be given;
    /// "method=curl", one that must have this value, given or by default; or ".vdb", a file with this extension among
    /// the words, or this format=. If none holds, giving the option is a warning.
    std::vector<std::string> onlyWith = {};
    /// Values, possibly expressions, that this option implies for others that are not given.
    std::map<std::string, std::string> implied = {};
    /// With this option, the action is a function of its inputs and the moment, and does not advance with the frames.
    bool timeless = false;
    /// The option only selects the objects that the action takes from the stacks. A graph has links instead.
    bool selects = false;
    std::vector<std::string> formerly = {}; ///< Names that it had in the last release: still taken, but not shown.
};

/// The words that an action takes in addition to its options, such as file names: `minimum` to `maximum` of them.
struct Positional {
    std::string what = {};
    size_t minimum = 0, maximum = 0;
    /// The words are formulas: the constants of -set and F, FF, T and fps need no {} in them.
    bool formulas = false;
    bool actions = false; ///< The words are names of actions: -help -noise.
};

} // namespace curlew::app
