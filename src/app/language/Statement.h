// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Program.h"

namespace curlew::app {

/// Of JSON documents.
constexpr int kGraphVersion = 1;

/// One action of a text, checked against its declaration.
struct Statement {
    Arguments arguments;
    std::map<std::string, std::vector<std::string>> inputs = {}; ///< Names of objects, by the input they are given to.
    std::string as = {};                                         ///< The name of the result.
    SourceLocation location = {};
};

/// What a text consists of: statements, and graphs that it includes.
struct Included {
    std::string json = {}; ///< The text of a JSON document; "" for a statement.
    std::optional<Statement> statement = {};
    SourceLocation location = {};
};

std::vector<Included> statementsOf(const std::vector<std::string>& tokens, const Reading& reading);
std::vector<Included> statementsOfScene(const std::string& text, const std::string& name, const Reading& reading);

/// Whether an object fits an input of these kinds; a grid that is not known yet fits where some grid does.
bool fits(const std::vector<Kind>& kinds, const Object& object);

/// Whether the values of an option of type `ages` are names instead.
bool areNames(const std::string& value);

} // namespace curlew::app
