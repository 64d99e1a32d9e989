// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace curlew::app {

/// The values of the variables in expressions. Without -frames, they are those of a first frame 1, or of a graph's
/// `moment`. Before -frames, they are those of a first frame 1 at its rate.
struct Moment {
    double frame = 1; ///< FF. A whole number except for fields evaluated between two frames.
    double time = 0;  ///< T, in seconds since the first frame.
    double fps = 24;  ///< Frames per second.
    double part = 1;  ///< P, from 1: the part of the points that is made (-scatter part=each/N or part=P/N).

    /// Returns F: the frame rounded up to a whole number.
    double wholeFrame() const;
};

/// The kinds of variables that a text contains.
struct Variables {
    bool any = false;  ///< The value is only known when the program runs.
    bool time = false; ///< F, FF or T: the value changes with time.
    bool part = false; ///< P: the value changes from part to part.
    bool rate = false; ///< fps.
};

/// Expands a text. Each {expression} is replaced by its value. Expressions follow muParser's grammar, with the
/// variables F, FF, T, P and fps, the constant pi, and the functions floor, ceil, mod and clamp in addition to
/// muParser's. $F is replaced by the frame; $FN, %0Nd and N times # (N > 1) by the frame padded with zeros to N digits;
/// $P and $PN by the part; {{ by {; and $$, $# and $% by $, # and %. Values have enough digits to read the same number
/// back. Throws ValueError, naming the expression and the reason, if an expression is invalid or its value is not
/// finite.
std::string expanded(std::string_view text, const Moment& moment);

/// Returns a text of which expanded() makes this one.
std::string escaped(std::string_view text);

/// Returns which variables the expressions of a text contain. Throws ValueError if expanded() would throw at every
/// moment.
Variables variablesOf(std::string_view text);

/// The constants that -set defines.
using Constants = std::map<std::string, double>;

/// Replaces the names of constants in a text's {expressions} by their values.
std::string withConstants(std::string_view text, const Constants& constants);

/// Replaces the names of constants in a formula by their values, and F, FF, T and fps by {expressions}.
std::string formulaWithConstants(std::string_view formula, const Constants& constants);

/// Parses `NAME=VALUE`, whose value is a number or an {expression} without variables. Throws ValueError if the value is
/// invalid, or if the name is invalid or already has a meaning in expressions.
std::pair<std::string, double> constantOf(const std::string& definition);

} // namespace curlew::app
