// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Program.h"

namespace curlew::app {

/// The version of JSON documents.
constexpr int kGraphVersion = 1;

/// One action of a text, checked against its declaration.
struct Statement {
    Arguments arguments;
    std::map<std::string, std::vector<std::string>> inputs = {}; ///< Names of objects, by input.
    std::string as = {};                                         ///< The name of the result.
    SourceLocation location = {};
};

/// A part of a text: a statement or an included graph.
struct Included {
    std::string json = {}; ///< The text of a JSON document; "" for a statement.
    std::optional<Statement> statement = {};
    SourceLocation location = {};
};

std::vector<Included> statementsOf(const std::vector<std::string>& tokens, const Reading& reading);
std::vector<Included> statementsOfScene(const std::string& text, const std::string& name, const Reading& reading);

/// Returns whether an object fits an input of these kinds. A grid whose kind is not known yet fits if any kind of grid
/// does.
bool fits(const std::vector<Kind>& kinds, const Object& object);

/// Returns whether the value of an option of type `ages` consists of names instead.
bool areNames(const std::string& value);

} // namespace curlew::app
