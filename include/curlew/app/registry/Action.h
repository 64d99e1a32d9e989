// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Arguments.h"
#include "curlew/app/registry/Part.h"

#include <filesystem>
#include <functional>
#include <optional>

namespace curlew::app {

class Context;

/// The kinds of objects that actions take and make.
enum class Kind {
    field,    ///< A scalar field. As an input: any scalar field; as an output: one that is not a shape.
    noise,    ///< A scalar field that is not a shape.
    shape,    ///< A scalar field that is a signed distance (SDF).
    flow,     ///< A velocity field of any dimension.
    grid,     ///< An OpenVDB grid. As an input: any grid; as an output: neither a level set nor a velocity grid.
    levelSet, ///< A grid that is a level set.
    velocity, ///< A velocity grid.
    mesh,     ///< Triangles and quads.
    points,   ///< Points that may move.
    curves,   ///< Polylines.
    image,    ///< A picture.
    report,   ///< The measurements that actions have reported.
    file,     ///< A file of any kind.
};
const char* nameOf(Kind kind);

/// Returns whether an input of kind `wanted` accepts an object of kind `given`.
bool accepts(Kind wanted, Kind given);
bool accepts(const std::vector<Kind>& wanted, Kind given);

/// The properties of an object that are known before it is made.
struct Object {
    Kind kind = Kind::noise;
    int dimension = 3;              ///< Dimension of a field or flow.
    std::string name = {};          ///< Name of the output, or of the grid in a file.
    std::vector<Kind> perhaps = {}; ///< Other kinds that it may turn out to be: its file cannot be read yet.
    bool isWall = false;            ///< A shape that bounds a field.
};

/// The objects that an action can take: those on the stacks, or those linked to a node of a graph.
class Scope {
  public:
    virtual ~Scope() = default;
    /// Returns the number of objects that one of these kinds accepts.
    virtual size_t count(const std::vector<Kind>& kinds) const = 0;
    /// Returns the newest of those objects; nullopt if there is none.
    virtual std::optional<Object> newest(const std::vector<Kind>& kinds) const = 0;
    /// Returns the second newest of those objects; nullopt if there is none.
    virtual std::optional<Object> second(const std::vector<Kind>& kinds) const = 0;
    /// Returns whether links determine the inputs. Options that select from the stacks then have no effect.
    virtual bool linked() const = 0;

  protected:
    Scope() = default;
    Scope(const Scope&) = default;
    Scope& operator=(const Scope&) = default;
};

enum class Use {
    taken,   ///< The object leaves its stack unless keep=1 is given.
    stays,   ///< The object stays on its stack.
    changed, ///< The action's output of the same kind replaces the object on the stack. With keep=1, the output is a
             ///< new object beside it.
};

/// The number of objects that an input takes.
struct Amount {
    size_t min = 1, max = 1;
};

/// An input of an action.
struct Input {
    std::string name = {};
    std::vector<Kind> kinds = {}; ///< The accepted kinds. The input takes the newest object of any of them.
    Use use = Use::stays;
    Amount amount = {};
    std::string age = {};        ///< The option that selects objects by age instead of the newest; "" if there is none.
    std::string help = {};       ///< Condition or count that the amount does not express.
    bool firstKindFirst = false; ///< Prefers an object of the first kind to newer objects of other kinds.
    bool potential = false;      ///< Leaves out shapes that are walls if there are enough other fields.
    /// Given the objects on the stacks that the input accepts, newest first, returns which of them it takes. If it
    /// returns none, the input takes the newest objects.
    std::function<std::vector<size_t>(const std::vector<Object>&)> choose = {};
    /// The points are carried from frame to frame. If none are given, the action starts with no points and continues
    /// with its own result from the previous frame.
    bool accumulates = false;
    /// Returns the amount if it depends on the options. An amount of 0 means that the options leave the input without
    /// effect.
    std::function<Amount(const Arguments&, const Scope&)> amountWith = {};
    /// Returns whether, with these options, the object named for this input may also be the newest one for another.
    std::function<bool(const Arguments&)> shares = {};
    /// Returns the names of the objects that the action's words refer to. They are linked in this order.
    std::function<std::vector<std::string>(const Arguments&)> namesWith = {};
};

struct Output {
    std::string name = {};
    std::vector<Kind> kinds = {}; ///< The output has one of these kinds.
    Amount amount = {};
    std::string flag = {}; ///< The output is only made if this option is 1.
};

/// When a node is evaluated in a program with -frames, if its place in the program does not determine it.
enum class InFrames {
    asInputs, ///< Once, unless an option or an input changes with time.
    once,     ///< Once, even if its inputs change: points that exist from the first frame on.
    each,     ///< In each frame: the node advances with the frames.
};

/// How a node is evaluated.
enum class Evaluation {
    value,   ///< A function of its inputs, its options and the moment.
    anyTime, ///< Like `value`, but also evaluated between frames: fields and flows.
    file,    ///< A value read from files or provided by the caller.
    effect,  ///< Has a side effect or reports: evaluated whenever the program runs.
};

struct World;

/// Files that an action reads and writes.
struct FileUse {
    std::vector<std::string> read = {}, written = {};
};

/// One action, declared once.
struct Action {
    std::string name = {};
    std::string group = {};     ///< The group under which the help lists it.
    std::string summary = {};   ///< One line of text.
    std::string details = {};   ///< More text, which only the help of the action shows.
    std::string shortName = {}; ///< Another name on the command line: h for help.
    /// The inputs. If several inputs have the same kinds, the last one takes the newest object.
    std::vector<Input> takes = {};
    /// The outputs, in the order in which they are pushed on their stacks.
    std::vector<Output> makes = {};
    std::vector<Option> options = {};
    Positional positional = {};
    std::vector<std::string> examples = {};
    Evaluation evaluation = Evaluation::value;
    InFrames inFrames = InFrames::asInputs;
    bool setting = false; ///< A setting for the nodes that follow: quiet, threads, … Settings are evaluated first.
    bool varies = false;  ///< Whether the outputs depend on the moment, whatever the options.
    /// Returns whether the outputs depend on the moment with these options and files, even without an expression.
    std::function<bool(const Arguments&)> variesWith = {};
    /// Returns which part of the outputs is made; or that all are, one after the other, with what depends on them.
    std::function<Part(const Arguments&)> partWith = {};
    bool readsReport = false; ///< Whether the outputs depend on the report so far.
    bool conforms = false; ///< Whether the output is a field that conforms to a wall. Such a field has no effect unless
                           ///< a flow uses it.
    std::function<void(Context&, const Arguments&)> run = {};
    /// Called for every node before anything is evaluated, to fail early (if an output is not writable, for example).
    std::function<void(const Arguments&)> prepare = {};
    /// Returns the outputs for these options and inputs, if `makes` and the inputs' dimensions do not determine them.
    std::function<std::vector<Object>(const Arguments&, const std::vector<std::vector<Object>>& inputs, const World&)>
        makesWith = {};
    /// For actions that write files: returns the kinds of objects that a file can hold. An action whose files take
    /// different objects becomes one node per selection of objects.
    std::function<std::vector<Kind>(const Arguments&, const std::string& file)> holds = {};
    /// For other actions that use files: returns their names.
    std::function<FileUse(const Arguments&)> files = {};

    /// Returns whether the outputs change with time even if the inputs do not.
    bool changes(const Arguments& arguments) const;
    /// Returns whether the action advances with the frames, given these options.
    bool advances(const Arguments& arguments) const;
    Part part(const Arguments& arguments) const { return partWith ? partWith(arguments) : Part{}; }
    /// Returns whether an option makes the action a function of its inputs and the moment (Option::timeless).
    bool timeless(const Arguments& arguments) const;
    const Option* option(std::string_view optionName) const;
    const Input* input(std::string_view inputName) const;
    size_t inputIndex(std::string_view inputName) const; ///< Throws std::logic_error if there is none.
    bool makesKind(Kind kind) const;
};

/// Gives a program information about files before it runs.
struct World {
    /// Returns the objects in a file, including those that the program itself writes to it earlier. Returns nullopt if
    /// they are not known yet.
    std::function<std::optional<std::vector<Object>>(const std::string& file)> contents = {};
    /// Returns a copy of a stream (LocalFile.h), whose name ends with `ending`. The copy is made once, so that its
    /// header can be read.
    std::function<std::filesystem::path(const std::string& stream, const std::string& ending)> streamed = {};
    bool lenient = false; ///< If true, missing files are accepted, because the text is only checked.
};

/// All actions, in the order in which the help lists them.
using Registry = std::vector<Action>;

} // namespace curlew::app
