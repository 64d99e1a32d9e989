#include "curlew/app/Program.h"

#include "Context.h"
#include "Runner.h"
#include "curlew/app/Expression.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Text.h"
#include "curlew/base/InputFile.h"

#include <sstream>

namespace curlew::app {

namespace {

constexpr int kDeepestScene = 16, kMostScenes = 10000;

/// -1.5 is a value, -1x an action.
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

class Parser {
  public:
    Program takeProgram() { return std::move(mProgram); }
    const Place& place() const { return mPlace; }

    void commandLine(const std::vector<std::string>& tokens) {
        for (size_t k = 0; k < tokens.size();) {
            if (!isAction(tokens[k]))
                throw ValueError(
                    fmt::format("'{}' is not an action; actions begin with a dash: curlew -help", tokens[k]));
            const size_t begin = k++;
            while (k < tokens.size() && !isAction(tokens[k])) ++k;
            const size_t dashes = tokens[begin].starts_with("--") ? 2 : 1;
            action(tokens[begin].substr(dashes),
                   {tokens.begin() + static_cast<std::ptrdiff_t>(begin) + 1,
                    tokens.begin() + static_cast<std::ptrdiff_t>(k)},
                   "");
        }
    }

    void scene(const std::string& text, const std::string& name) {
        if (++mDepth > kDeepestScene)
            throw ValueError(
                fmt::format("scene '{}': scenes include each other more than {} deep", name, kDeepestScene));
        if (++mScenes > kMostScenes)
            throw ValueError(fmt::format("scene '{}': more than {} scenes are included", name, kMostScenes));
        std::istringstream lines(text);
        std::string line, pending;
        for (int number = 1, first = 1; std::getline(lines, line); ++number) {
            if (pending.empty()) first = number;
            if (mDepth == 1) mPlace = {.line = first};
            if (line.ends_with('\r')) line.pop_back();
            const bool continues = line.ends_with('\\');
            if (continues) line.pop_back();
            pending += line + " ";
            if (continues) continue;
            sceneLine(std::exchange(pending, {}), fmt::format("{}:{}: ", name, first));
        }
        if (!pending.empty())
            throw ValueError(fmt::format("scene '{}' ends with a \\: its last line is missing", name));
        --mDepth;
    }

  private:
    void sceneLine(const std::string& line, const std::string& place) {
        auto words = inContextOf(place.substr(0, place.size() - 2), [&] { return wordsOf(line); });
        if (words.empty()) return;
        std::string name = words.front();
        if (name.starts_with('-')) name.erase(0, 1);
        words.erase(words.begin());
        action(name, words, place);
    }

    void action(const std::string& name, const std::vector<std::string>& tokens, const std::string& place) {
        mPlace.action = name;
        const Action& declared = inContextOf(place.empty() ? "command line" : place.substr(0, place.size() - 2),
                                             [&]() -> const Action& { return findAction(name); });
        if (name == "set") return inContextOf(place + "-set", [&] { define(tokens); });
        const Arguments arguments = inContextOf(place + "-" + name, [&] {
            Arguments given(declared);
            for (const auto& token : tokens) given.add(withConstants(token, mConstants));
            given.finish();
            given.setLine(mPlace.line);
            return given;
        });
        if (name != "config") {
            mProgram.actions.push_back(arguments);
            return;
        }
        for (const auto& file : arguments.words())
            scene(inContextOf(place + "-config", [&] { return readText(file); }), file);
    }

    /// The first definition of a name counts: a scene's own is what it has unless one before -config says otherwise.
    void define(const std::vector<std::string>& definitions) {
        if (definitions.empty()) throw ValueError("needs NAME=VALUE");
        for (const auto& definition : definitions) mConstants.insert(constantOf(withConstants(definition, mConstants)));
    }

    Program mProgram;
    Constants mConstants;
    Place mPlace;
    int mDepth = 0, mScenes = 0;
};

} // namespace

Program parseCommandLine(const std::vector<std::string>& tokens) {
    Parser parser;
    parser.commandLine(tokens);
    return parser.takeProgram();
}

Program parseScene(const std::string& text, const std::string& name, Place* place) {
    Parser parser;
    try {
        parser.scene(text, name);
    } catch (...) {
        if (place) *place = parser.place();
        throw;
    }
    return parser.takeProgram();
}

void run(const Program& program, Session& session) { Runner(program, session).run(); }

std::string sceneOf(const Program& program) {
    std::string text;
    for (const auto& arguments : program.actions) text += arguments.program(false) + "\n";
    return text;
}

} // namespace curlew::app
