// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Arguments.h"

#include <filesystem>
#include <functional>
#include <optional>

namespace curlew::app {

class Context;

/// The kinds of objects that actions take and make.
enum class Kind {
    field,    ///< A scalar field. As an input: any; as an output: one that is not a shape.
    noise,    ///< A scalar field that is not a shape.
    shape,    ///< A scalar field that is a signed distance.
    flow,     ///< A velocity field of any dimension.
    grid,     ///< An OpenVDB grid. As an input: any; as an output: one that is neither of the next two.
    levelSet, ///< A grid that is a level set.
    velocity, ///< A grid of velocities.
    mesh,     ///< Triangles and quads.
    points,   ///< Points that may move.
    curves,   ///< Polylines.
    image,    ///< A picture.
    report,   ///< The figures that actions have measured.
    file,     ///< A file of any kind.
};
const char* nameOf(Kind kind);

/// Whether an input of kind `wanted` accepts an object of kind `given`.
bool accepts(Kind wanted, Kind given);
bool accepts(const std::vector<Kind>& wanted, Kind given);

/// What is known of an object before it is made.
struct Object {
    Kind kind = Kind::noise;
    int dimension = 3;      ///< Of fields and flows.
    std::string name = {};  ///< Of the output, or of the grid in a file.
    bool uncertain = false; ///< A grid of a file that cannot be looked into yet: accepted where any grid is.
};

/// What is there for an action to take: the stacks, or for a node of a graph what is linked to it.
class Scope {
  public:
    virtual ~Scope() = default;
    /// How many objects there are that one of these kinds accepts.
    virtual size_t count(const std::vector<Kind>& kinds) const = 0;
    /// The newest of them; nullopt if there is none.
    virtual std::optional<Object> newest(const std::vector<Kind>& kinds) const = 0;
    /// The newest but one.
    virtual std::optional<Object> second(const std::vector<Kind>& kinds) const = 0;
    /// Whether links say what is taken; options that select from the stacks then mean nothing.
    virtual bool linked() const = 0;

  protected:
    Scope() = default;
    Scope(const Scope&) = default;
    Scope& operator=(const Scope&) = default;
};

enum class Use {
    taken,   ///< It leaves its stack, unless keep=1 is given.
    stays,   ///< It stays on its stack.
    changed, ///< It stays, and is another afterwards: the action's output of the same kind. With keep=1 that is a new
             ///< object beside it.
};

/// How many objects an input takes.
struct Amount {
    size_t least = 1, most = 1;
};

/// Something that an action takes: objects of these kinds.
struct Input {
    std::string name = {};
    std::vector<Kind> kinds = {}; ///< Any of them: whichever is the newest.
    Use use = Use::stays;
    Amount amount = {};
    std::string age = {};        ///< The option that chooses others than the newest by their ages; "" if there is none.
    std::string help = {};       ///< What the amount does not say.
    bool firstKindFirst = false; ///< An object of the first kind is preferred to newer ones of the others.
    /// Points that the frames carry along; without any, it begins with none, and goes on from its own result of the
    /// frame before.
    bool accumulates = false;
    /// The amount with these options, if it depends on them. An amount of 0 means that they leave the input without
    /// effect.
    std::function<Amount(const Arguments&, const Scope&)> amountWith = {};
};

struct Output {
    std::string name = {};
    std::vector<Kind> kinds = {}; ///< One of them.
    Amount amount = {};
    std::string flag = {}; ///< It is only made if this option is 1.
};

/// When a node is evaluated in a program with -frames, if its place in the program does not say so.
enum class InFrames {
    asInputs, ///< Once, unless an option or an input changes with time.
    once,     ///< Once, whatever it is made from: the points that there are from the first frame on.
    each,     ///< In each frame: it advances with the frames.
};

/// How a node is evaluated.
enum class Evaluation {
    value,   ///< It is a function of its inputs, its options and the moment.
    anyTime, ///< The same, and wanted between frames too: fields and flows.
    file,    ///< A value that comes from files or from the caller.
    effect,  ///< It changes something outside, or reports: evaluated whenever the program runs.
};

struct World;

/// One action, declared once.
struct Action {
    std::string name = {};
    std::string group = {};   ///< Where help lists it.
    std::string summary = {}; ///< One line.
    /// Of several inputs with the same kinds, the last one takes the newest object.
    std::vector<Input> takes = {};
    /// In the order in which they are pushed on their stacks.
    std::vector<Output> makes = {};
    std::vector<Option> options = {};
    Positional positional = {};
    std::vector<std::string> examples = {};
    Evaluation evaluation = Evaluation::value;
    InFrames inFrames = InFrames::asInputs;
    bool setting = false; ///< An effect on what follows that moves nothing: quiet, threads, … A graph's come first.
    bool varies = false;  ///< What it makes depends on the moment, whatever its options.
    /// Whether what it makes depends on the moment with these options and files, if no expression says so.
    std::function<bool(const Arguments&)> variesWith = {};
    bool readsReport = false; ///< What it makes depends on the report so far.
    bool conforms = false;    ///< It makes a field that conforms to a wall, which means nothing unless a flow uses it.
    std::function<void(Context&, const Arguments&)> run = {};
    /// Called for the whole program before anything is evaluated: to fail early (an unwritable output, say).
    std::function<void(const Arguments&)> prepare = {};
    /// What it makes with these options from these inputs, if `makes` and the inputs' dimensions do not say so.
    std::function<std::vector<Object>(const Arguments&, const std::vector<std::vector<Object>>& inputs, const World&)>
        makesWith = {};
    /// For files that each hold other kinds: the inputs that a file can hold. The program has a node for each choice.
    std::function<std::vector<Kind>(const Arguments&, const std::string& file)> holds = {};

    /// Whether what it makes changes with time though its inputs do not.
    bool changes(const Arguments& arguments) const;
    /// Whether it advances with the frames, with these options.
    bool advances(const Arguments& arguments) const;
    /// Whether one of these options makes it a value of its inputs and of the moment (Option::timeless).
    bool timeless(const Arguments& arguments) const;
    const Option* option(std::string_view optionName) const;
    const Input* input(std::string_view inputName) const;
    size_t inputIndex(std::string_view inputName) const; ///< Throws std::logic_error if there is none.
    bool makesKind(Kind kind) const;
};

/// What a program can find out about the outside before it runs.
struct World {
    /// What a file holds; also what the program itself writes into it before. nullopt if it cannot be known yet.
    std::function<std::optional<std::vector<Object>>(const std::string& file)> contents = {};
    /// The copy of a stream (LocalFile.h), whose name ends with `ending`; made once, so that it can be looked into.
    std::function<std::filesystem::path(const std::string& stream, const std::string& ending)> streamed = {};
    bool lenient = false; ///< Files that are not there may come later: a text is only checked.
};

/// All actions, in the order in which help lists them.
using Registry = std::vector<Action>;

} // namespace curlew::app
