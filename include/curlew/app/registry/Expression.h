// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace curlew::app {

/// What the variables of expressions stand for. Outside of -frames that is what a first frame 1 has.
struct Moment {
    double frame = 1; ///< FF; whole, but for fields that are wanted at a time between two frames.
    double time = 0;  ///< T, seconds since the first frame.
    double fps = 24;  ///< Frames per second.

    /// F: the frame that ends there, or in which the moment is.
    double wholeFrame() const;
};

/// Which variables a text has.
struct Variables {
    bool any = false;  ///< F, FF, T or fps: its value is only known once the program runs.
    bool time = false; ///< F, FF or T: it changes with time.
};

/// The text with the value of each {expression} in its place (muParser's grammar; variables F, FF, T and fps, the
/// constant pi, and beside muParser's functions floor, ceil, mod and clamp), and with the frame for $F, the frame
/// padded with zeros to N digits for $FN, %0Nd and N times # (N > 1), { for {{ and $, # and % for $$, $# and $%. Values
/// have as many digits as it takes to read the same number back. Throws ValueError with the expression and what is
/// wrong with it; also where its value is not finite.
std::string expanded(std::string_view text, const Moment& moment);

/// Which variables there are in the expressions of a text. Throws ValueError where expanded() would at every moment.
Variables variablesOf(std::string_view text);

/// Names that -set has given values.
using Constants = std::map<std::string, double>;

/// The text with the constants' values in place of their names in its {expressions}. The result needs no constants.
std::string withConstants(std::string_view text, const Constants& constants);

/// The name and the value of `NAME=VALUE`, whose value is a number or an {expression} without variables. Throws
/// ValueError also for a name that is none, or that expressions already have.
std::pair<std::string, double> constantOf(const std::string& definition);

} // namespace curlew::app
