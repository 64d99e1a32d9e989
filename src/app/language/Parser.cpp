// SPDX-License-Identifier: Apache-2.0
#include "Statement.h"
#include "curlew/app/registry/Expression.h"
#include "curlew/app/registry/InContext.h"
#include "curlew/app/registry/Registry.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/InputFile.h"

#include <algorithm>
#include <sstream>

namespace curlew::app {

namespace {

constexpr int kDeepestScene = 16, kMaxScenes = 10000;
constexpr size_t kMaxActions = 20000;         ///< Limit per program; each action takes a few kilobytes.
constexpr size_t kMaxText = size_t(16) << 20; ///< Limit in bytes for a program's text, with all included scenes.

/// Returns whether a token is an action: -1.5 is a value, -1x an action.
bool isAction(const std::string& token) {
    double number = 0;
    return token.size() > 1 && token[0] == '-' && !parseReal(token, number);
}

std::string readText(const std::string& file) {
    std::ostringstream text;
    text << openToRead(file).rdbuf();
    if (text.str().find('\0') != std::string::npos)
        throw FileError(fmt::format("'{}' is not a scene: it is not text", file));
    return text.str();
}

/// How the constants of -set are put into a word.
using Substitution = std::string (*)(std::string_view, const Constants&);

class Parser {
  public:
    explicit Parser(const Reading& reading) : mReading(reading) {}

    std::vector<Included> take() { return std::move(mStatements); }

    void commandLine(const std::vector<std::string>& tokens) {
        for (size_t k = 0; k < tokens.size();) {
            if (!isAction(tokens[k]))
                throw ValueError(
                    fmt::format("'{}' is not an action; actions begin with a dash: curlew -help", tokens[k]));
            const size_t begin = k++;
            while (k < tokens.size() && (!isAction(tokens[k]) || isWordOf(tokens[begin], tokens[k]))) ++k;
            const size_t dashes = tokens[begin].starts_with("--") ? 2 : 1;
            action(tokens[begin].substr(dashes), {tokens.begin() + static_cast<std::ptrdiff_t>(begin) + 1,
                                                  tokens.begin() + static_cast<std::ptrdiff_t>(k)});
        }
        for (const auto& [name, value] : mUnused)
            throw ValueError(fmt::format("-set: nothing uses '{}'{}", name, didYouMean(name, mSceneNames)));
    }

    void scene(const std::string& text, const std::string& name) {
        if (++mDepth > kDeepestScene)
            throw ValueError(fmt::format("scene '{}': scenes are nested more than {} deep", name, kDeepestScene));
        if (++mScenes > kMaxScenes)
            throw ValueError(fmt::format("scene '{}': more than {} scenes are included", name, kMaxScenes));
        const std::string outerFile = mLocation.file;
        std::istringstream lines(text);
        std::string line, pending;
        for (int number = 1, first = 1; std::getline(lines, line); ++number) {
            if (pending.empty()) first = number;
            locate({.line = mDepth == 1 ? first : mLocation.line, .file = fmt::format("{}:{}", name, first)});
            if (line.ends_with('\r')) line.pop_back();
            const bool continues = line.ends_with('\\');
            if (continues) line.pop_back();
            pending += line + " ";
            if (!continues) sceneLine(std::exchange(pending, {}));
        }
        if (!pending.empty())
            throw ValueError(
                fmt::format("scene '{}' ends with a \\, but the line that should follow is missing", name));
        mLocation.file = outerFile;
        --mDepth;
    }

  private:
    const Action* known(const std::string& token) const {
        const std::string name = token.substr(std::min(token.find_first_not_of('-'), token.size()));
        const auto found = std::find_if(mReading.registry.begin(), mReading.registry.end(), [&](const Action& action) {
            return action.name == name || (!name.empty() && action.shortName == name);
        });
        return found == mReading.registry.end() ? nullptr : &*found;
    }

    /// Returns whether a token that begins with a dash is a word of the action: a formula, as in -formula -x+1, or the
    /// name of an action, as in -help -noise.
    bool isWordOf(const std::string& action, const std::string& token) const {
        const Action* declared = known(action);
        return declared && (declared->positional.actions || (declared->positional.formulas && !known(token)));
    }

    void locate(SourceLocation location) {
        mLocation = std::move(location);
        if (mReading.location) *mReading.location = mLocation;
    }

    void sceneLine(const std::string& line) {
        auto words = inContextOf(mLocation.file, [&] { return wordsOf(line); });
        if (words.empty()) return;
        std::string name = words.front();
        if (name.starts_with('-')) name.erase(0, 1);
        words.erase(words.begin());
        action(name, words);
    }

    void action(const std::string& name, const std::vector<std::string>& tokens) {
        SourceLocation location = mLocation;
        location.action = name;
        locate(location);
        const Action* const found = inContextOf(location.file.empty() ? "command line" : location.file,
                                                [&] { return &findAction(mReading.registry, name); });
        const Action& declared = *found;
        inContextOf(contextOf(location), [&] {
            if (name == "set") return define(tokens);
            Statement statement{.arguments = Arguments(declared), .location = location};
            for (const auto& token : tokens) {
                const bool formula = declared.positional.formulas && token.find('=') == std::string::npos;
                const Substitution with = formula ? formulaWithConstants : withConstants;
                noteUse(token, with);
                const std::string text = with(token, mConstants);
                count(text.size());
                add(statement, text);
            }
            statement.arguments.finish();
            if (!statement.as.empty() && declared.makes.empty())
                throw ValueError(fmt::format("as={}: the action makes no object that could be named", statement.as));
            if (mStatements.size() == kMaxActions)
                throw ValueError(fmt::format("the program has more than {} actions", kMaxActions));
            if (name != "config")
                mStatements.push_back({.statement = std::move(statement), .location = location});
            else
                include(statement.arguments.words());
        });
    }

    /// Limits the total text, since nested includes can multiply it a thousandfold.
    void count(size_t bytes) {
        mText += bytes;
        if (mText > kMaxText)
            throw ValueError(
                fmt::format("the program has more than {} MiB of text, including its scenes", kMaxText >> 20));
    }

    void include(const std::vector<std::string>& files) {
        for (const auto& file : files) {
            const SourceLocation here = mLocation;
            const std::string text = readText(file);
            count(text.size());
            if (file.ends_with(".json"))
                mStatements.push_back({.json = text, .location = {.file = file}});
            else
                scene(text, file);
            locate(here);
        }
    }

    /// Adds one token: as=NAME, INPUT=NAMES, an option or a word.
    static void add(Statement& statement, const std::string& token) {
        const Action& action = statement.arguments.action();
        const size_t equals = token.find('=');
        const std::string name = token.substr(0, equals),
                          value = equals == std::string::npos ? "" : token.substr(equals + 1);
        if (equals == std::string::npos) return statement.arguments.add(token);
        if (name == "as") {
            if (!isNodeName(value))
                throw ValueError(fmt::format(
                    "as={} is not a valid name; use letters, digits, _ and -, beginning with a letter", value));
            if (!std::exchange(statement.as, value).empty()) throw ValueError("as= is given twice");
            return;
        }
        const Option* option = action.option(name);
        const bool ages = option && option->type == OptionType::ages;
        const auto input = std::find_if(action.takes.begin(), action.takes.end(), [&](const Input& i) {
            return i.name == name || (ages && i.age == name && areNames(value));
        });
        if (input == action.takes.end() || (option && !areNames(value))) return statement.arguments.add(token);
        if (!statement.inputs.emplace(input->name, split(value, ',')).second)
            throw ValueError(fmt::format("input '{}' is given twice", input->name));
    }

    /// The first definition of a name counts, so a definition before -config overrides the scene's own.
    void define(const std::vector<std::string>& definitions) {
        if (definitions.empty()) throw ValueError("needs NAME=VALUE");
        for (const auto& definition : definitions) {
            noteUse(definition);
            const auto [name, value] = constantOf(withConstants(definition, mConstants));
            const auto [known, isNew] = mConstants.emplace(name, value);
            if (mDepth > 0) {
                mUnused.erase(name);
                mSceneNames.push_back(name);
            } else if (isNew) {
                mUnused.emplace(name, value);
            } else if (known->second != value) {
                throw ValueError(fmt::format(
                    "'{}' is already {}, and the first value counts; write -set before -config", name, known->second));
            }
        }
    }

    /// A misspelled name on the command line would have no effect and no message.
    void noteUse(const std::string& token, Substitution with = withConstants) {
        std::erase_if(mUnused, [&](const auto& constant) { return with(token, {constant}) != with(token, {}); });
    }

    const Reading& mReading;
    std::vector<Included> mStatements;
    Constants mConstants, mUnused;        ///< mUnused: those of the command line that nothing has used yet.
    std::vector<std::string> mSceneNames; ///< Names that scenes define.
    SourceLocation mLocation;
    int mDepth = 0, mScenes = 0;
    size_t mText = 0; ///< Bytes read so far.
};

} // namespace

bool areNames(const std::string& value) {
    return !value.empty() && std::isdigit(static_cast<unsigned char>(value.front())) == 0 && value.front() != '-' &&
           value.front() != '{' && value.front() != '+' && value.front() != '.';
}

std::vector<Included> statementsOf(const std::vector<std::string>& tokens, const Reading& reading) {
    Parser parser(reading);
    parser.commandLine(tokens);
    return parser.take();
}

std::vector<Included> statementsOfScene(const std::string& text, const std::string& name, const Reading& reading) {
    Parser parser(reading);
    parser.scene(text, name);
    return parser.take();
}

} // namespace curlew::app
