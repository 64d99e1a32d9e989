#pragma once

#include "curlew/app/Expression.h"
#include "curlew/math/Range.h"
#include "curlew/math/Vec.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace curlew::app {

class Session;
class Arguments;

enum class OptionType {
    flag,        ///< 0 or 1
    integer,     ///< a whole number; 1e6 is one
    real,        ///< a finite number
    vector,      ///< x,y,z; or one number for all three
    coordinates, ///< a number for each of 1 to 7 axes; or one for all of them
    interval,    ///< lower,upper
    box,         ///< xmin,ymin,zmin,xmax,ymax,zmax
    choice,      ///< one of a list of words
    text,        ///< anything
    ages,        ///< positions on a stack, 0 the newest: 0 or 0,2
};

/// One option of an action, declared once: the parser, the help and the documentation are made from it.
struct Option {
    std::string name = {};
    OptionType type = OptionType::real;
    std::string fallback = {}; ///< The default, as one would type it; "" for none.
    std::string help = {};
    std::string unit = {};
    std::vector<std::string> choices = {};
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
    bool exclusive = false; ///< The lower bound itself is not allowed.
};

/// What an action takes beside options: `minimum` to `maximum` words (file names).
struct Positional {
    std::string what = {};
    size_t minimum = 0, maximum = 0;
};

/// What actions take and make.
enum class Kind {
    field,    ///< a scalar field; taken: any, made: one that is no shape
    noise,    ///< a scalar field that is no shape
    shape,    ///< a scalar field that is a signed distance
    flow,     ///< of any dimension
    grid,     ///< any grid, a level set too
    levelSet, ///< a grid that is one
    velocity, ///< a grid that is one
    mesh,     ///< triangles and quads
    points,   ///< that may move
    curves,   ///< polylines
    image,    ///< a picture
    report,   ///< the figures that actions have measured
    file,     ///<
};
const char* nameOf(Kind kind);

enum class Use {
    taken,   ///< It leaves its stack, unless keep=1 is given.
    stays,   ///< It stays as it is.
    changed, ///< It stays, and is another afterwards; it is also among what the action makes.
};

/// Something that an action takes: the newest of these kinds.
struct Input {
    std::string name = {};
    std::vector<Kind> kinds = {}; ///< One of them: whichever is the newest.
    Use use = Use::stays;
    size_t least = 1, most = 1;
    std::string age = {};  ///< The option that chooses another than the newest; "" for none.
    std::string help = {}; ///< What `least` and `most` do not say.
};

struct Output {
    std::string name = {};
    std::vector<Kind> kinds = {}; ///< One of them.
    size_t least = 1, most = 1;
    std::string flag = {}; ///< It is only made where this option is 1.
};

struct Action {
    std::string name = {};
    std::string group = {};                ///< Where help lists it.
    std::string summary = {};              ///< One line.
    std::string inputs = {}, outputs = {}; ///< For the reader; `takes` and `makes` say it to programs.
    /// In the order in which their kinds of stacks have them, the newest last.
    std::vector<Input> takes = {};
    std::vector<Output> makes = {};
    std::vector<Option> options = {};
    Positional positional = {};
    std::vector<std::string> examples = {};
    std::function<void(Session&, const Arguments&)> run = {};
    /// Called for the whole program before anything runs: to fail early (an unwritable output, say).
    std::function<void(const Arguments&)> prepare = {};
};

/// The options and words given to one use of an action, checked against its declaration. Reading an option that was not
/// declared, or as another type, is a programming error (std::logic_error). Values and words may have expressions
/// (Expression.h); what is read is their value at one moment: the default one, or that which at() was given.
class Arguments {
  public:
    explicit Arguments(const Action& action) : mAction(&action) {}

    const Action& action() const { return *mAction; }
    const std::vector<std::string>& words() const { return mWords; }

    bool given(std::string_view name) const { return mValues.contains(std::string(name)); }
    bool flag(std::string_view name) const;
    int64_t integer(std::string_view name) const;
    double real(std::string_view name) const;
    Vec3d vector(std::string_view name) const;
    Box box(std::string_view name) const;
    Range interval(std::string_view name) const;
    /// How many numbers there are.
    int count(std::string_view name) const;
    /// Throws ValueError where neither one number was given nor N.
    template <int N>
    Vec<double, N> coordinates(std::string_view name) const {
        Vec<double, N> v;
        const std::vector<double> numbers = coordinateList(name, N);
        for (int i = 0; i < N; ++i) v[i] = numbers[static_cast<size_t>(i)];
        return v;
    }
    std::string text(std::string_view name) const; ///< Also of a choice: its word.
    std::vector<size_t> ages(std::string_view name) const;

    size_t choice(std::string_view name) const; ///< The position of the word among the choices.

    /// The line of the scene that it is on, from 1 (where scenes include others, of the outermost); 0: of none.
    int line() const { return mLine; }
    void setLine(int line) { mLine = line; }

    /// Takes one token, option=value or a word. Throws ValueError naming the nearest valid option or the valid values;
    /// values that depend on a variable are only judged by at().
    void add(const std::string& token);
    /// Throws ValueError where words are missing.
    void finish() const;

    /// The same as of that moment. Throws ValueError where a value is not valid then.
    Arguments at(const Moment& moment) const;
    /// Whether a value or word changes with time.
    bool changes() const;

    /// The action as it was given, expressions and all, to run again: "-noise type=psrd seed=2".
    std::string program(bool withDash = true) const;

  private:
    const Option& option(std::string_view name, OptionType type) const;
    std::vector<double> coordinateList(std::string_view name, size_t axes) const;
    std::string value(const Option& option) const;

    const Action* mAction;
    std::vector<std::string> mWords, mWrittenWords;
    std::map<std::string, std::string> mValues, mWritten;
    int mLine = 0;
};

} // namespace curlew::app
