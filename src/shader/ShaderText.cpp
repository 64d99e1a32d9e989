// SPDX-License-Identifier: Apache-2.0
#include "curlew/shader/ShaderText.h"

#include "Preamble.h"
#include "Syntax.h"
#include "Translation.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <set>

namespace curlew {

namespace {

constexpr size_t kMostOperations = 200000;

size_t operandsOf(SymbolOp op) {
    switch (op) {
        case SymbolOp::constant:
        case SymbolOp::parameter:
        case SymbolOp::result:
            return 0;
        case SymbolOp::mulAdd:
        case SymbolOp::select:
            return 3;
        case SymbolOp::add:
        case SymbolOp::subtract:
        case SymbolOp::multiply:
        case SymbolOp::divide:
        case SymbolOp::power:
        case SymbolOp::min:
        case SymbolOp::max:
        case SymbolOp::less:
        case SymbolOp::lessEqual:
        case SymbolOp::equal:
        case SymbolOp::both:
        case SymbolOp::either:
        case SymbolOp::bitAnd:
        case SymbolOp::bitXor:
            return 2;
        default:
            return 1;
    }
}

/// How often each node of a function is used; 0 for those that do not contribute to a result.
struct Uses {
    std::vector<size_t> nodes;
    std::vector<bool> calls;

    explicit Uses(const SymbolFunction& function) : nodes(function.nodes.size()), calls(function.calls.size()) {
        for (const uint32_t result : function.results) ++nodes[result];
        for (size_t k = nodes.size(); k-- > 0;) {
            if (nodes[k] == 0) continue;
            const SymbolNode& node = function.nodes[k];
            for (size_t o = 0; o < operandsOf(node.op); ++o) ++nodes[node.from[o]];
            if (node.op != SymbolOp::result) continue;
            const auto call = static_cast<size_t>(node.data >> 32);
            if (calls[call]) continue;
            calls[call] = true;
            // Further results of the call come before this one, but after its arguments.
            for (const uint32_t argument : function.calls[call].arguments) ++nodes[argument];
        }
    }
};

/// Writes the body of one function.
class Body {
  public:
    Body(const SymbolModule& module, const SymbolFunction& function, const Syntax& syntax,
         std::vector<std::string> parameters)
        : mModule(module), mFunction(function), mSyntax(syntax), mUses(function), mParameters(std::move(parameters)) {
        mExpressions.resize(function.nodes.size());
        mCalls.resize(function.calls.size());
        for (size_t k = 0; k < function.nodes.size(); ++k)
            if (mUses.nodes[k] > 0) write(k);
    }

    const std::string& statements() const { return mText; }
    std::vector<std::string> results() const {
        std::vector<std::string> all;
        for (const uint32_t result : mFunction.results) all.push_back(mExpressions[result]);
        return all;
    }

  private:
    static constexpr size_t kLongest = 90; // of an expression that is not given a name

    void write(size_t k) {
        const SymbolNode& node = mFunction.nodes[k];
        std::string expression = expressionOf(node);
        const bool simple =
            node.op == SymbolOp::constant || node.op == SymbolOp::parameter || node.op == SymbolOp::result;
        if (!simple && (mUses.nodes[k] > 1 || expression.size() > kLongest)) {
            const std::string name = fmt::format("t{}", mNames++);
            mText += mSyntax.variable(node.type, name, expression);
            expression = name;
        }
        mExpressions[k] = std::move(expression);
    }

    std::string expressionOf(const SymbolNode& node) {
        const auto high = static_cast<size_t>(node.data >> 32), low = static_cast<size_t>(node.data & 0xffffffff);
        switch (node.op) {
            case SymbolOp::constant:
                return mSyntax.constant({node.type, nullptr, node.data});
            case SymbolOp::parameter:
                return mParameters[low];
            case SymbolOp::result:
                return resultOf(high, low);
            case SymbolOp::table:
                return tableEntry(high, low, node.from[0]);
            case SymbolOp::buffer:
                return mSyntax.bufferElement(mModule.buffers()[low], mExpressions[node.from[0]]);
            default:
                break;
        }
        std::vector<std::string> operands;
        for (size_t o = 0; o < operandsOf(node.op); ++o) operands.push_back(mExpressions[node.from[o]]);
        return mSyntax.operation(node, mFunction.nodes[node.from[0]].type, operands);
    }

    std::string tableEntry(size_t table, size_t column, uint32_t row) {
        const size_t columns = mModule.tables()[table].columns;
        std::string& name = mRows[{table, row}];
        if (name.empty()) {
            name = fmt::format("g{}", mRows.size() - 1);
            mText += mSyntax.rowVariable(columns, name, mSyntax.tableRow(table, mExpressions[row]));
        }
        return columns == 1 ? name : fmt::format("{}.{}", name, "xyzw"[column]);
    }

    std::string resultOf(size_t index, size_t result) {
        const SymbolCall& call = mFunction.calls[index];
        const SymbolFunction& callee = mModule.functions()[call.function];
        std::string& name = mCalls[index];
        if (name.empty()) {
            name = fmt::format("c{}", index);
            std::vector<std::string> arguments;
            for (const uint32_t argument : call.arguments) arguments.push_back(mExpressions[argument]);
            mText += mSyntax.call(name, callee.results.size(), functionName(callee, call.function), arguments);
        }
        return fmt::format("{}.r{}", name, result);
    }

  public:
    static std::string functionName(const SymbolFunction& function, size_t index) {
        return fmt::format("flow_{}{}", function.name, index);
    }

  private:
    const SymbolModule& mModule;
    const SymbolFunction& mFunction;
    const Syntax& mSyntax;
    const Uses mUses;
    std::vector<std::string> mParameters, mExpressions, mCalls;
    std::map<std::pair<size_t, uint32_t>, std::string> mRows; ///< Rows of tables, by table and node of the row.
    std::string mText;
    size_t mNames = 0;
};

/// What the entries need.
struct Needed {
    std::set<size_t> functions, tables, structs;

    Needed(const SymbolModule& module, const std::vector<ShaderEntry>& entries) {
        for (const ShaderEntry& entry : entries) {
            add(module, entry.function);
            if (const size_t size = module.functions()[entry.function].results.size(); size > 4) structs.insert(size);
        }
    }

  private:
    void add(const SymbolModule& module, size_t index) {
        const SymbolFunction& function = module.functions()[index];
        const Uses uses(function);
        for (size_t k = 0; k < function.nodes.size(); ++k) {
            const SymbolNode& node = function.nodes[k];
            if (uses.nodes[k] == 0) continue;
            if (node.op == SymbolOp::table) tables.insert(static_cast<size_t>(node.data >> 32));
        }
        for (size_t k = 0; k < function.calls.size(); ++k) {
            if (!uses.calls[k]) continue;
            const size_t callee = function.calls[k].function;
            if (!functions.insert(callee).second) continue;
            structs.insert(module.functions()[callee].results.size());
            add(module, callee);
        }
    }
};

std::string inner(const SymbolModule& module, size_t index, const Syntax& syntax) {
    const SymbolFunction& function = module.functions()[index];
    std::vector<std::string> names;
    for (size_t k = 0; k < function.parameters.size(); ++k) names.push_back(fmt::format("a{}", k));
    const Body body(module, function, syntax, names);
    return syntax.function(Body::functionName(function, index), function.parameters, names, body.statements(),
                           body.results());
}

std::string outer(const SymbolModule& module, const ShaderEntry& entry, const Syntax& syntax) {
    const SymbolFunction& function = module.functions()[entry.function];
    std::vector<std::string> names;
    for (const auto& [name, size] : entry.parameters)
        for (size_t k = 0; k < size; ++k) names.push_back(size == 1 ? name : fmt::format("{}.{}", name, "xyzw"[k]));
    const Body body(module, function, syntax, names);
    std::string comment;
    for (size_t begin = 0; begin < entry.comment.size();) {
        const size_t end = std::min(entry.comment.find('\n', begin), entry.comment.size());
        comment += "// " + entry.comment.substr(begin, end - begin) + "\n";
        begin = end + 1;
    }
    return "\n" + comment + syntax.entry(entry, body.statements(), body.results());
}

/// Puts the tables of one column, or those of more, into a buffer with elements of this width. A row of up to four
/// numbers is read at once.
void addTables(const SymbolModule& module, const std::set<size_t>& tables, size_t width,
               std::vector<SymbolBuffer>& buffers, Syntax& syntax) {
    const SymbolBuffer buffer{fmt::format("flowData{}", buffers.size()), SymbolType::real, nullptr, width};
    std::vector<uint32_t> numbers;
    for (const size_t index : tables) {
        const auto& [columns, all] = module.tables()[index];
        if ((columns > 1) != (width > 1)) continue;
        syntax.putTable(index, buffer, numbers.size() / width);
        for (size_t k = 0; k < all.size(); ++k) {
            numbers.push_back(std::bit_cast<uint32_t>(static_cast<float>(all[k])));
            if ((k + 1) % columns == 0) numbers.resize(numbers.size() + width - columns);
        }
    }
    if (numbers.empty()) return;
    buffers.push_back(buffer);
    buffers.back().data = std::make_shared<const std::vector<uint32_t>>(std::move(numbers));
}

} // namespace

size_t operationsOf(const SymbolModule& module, size_t function) {
    // Functions call earlier ones only.
    std::vector<size_t> counts;
    for (size_t index = 0; index <= function; ++index) {
        const SymbolFunction& f = module.functions()[index];
        const Uses uses(f);
        size_t count = 0;
        for (const size_t n : uses.nodes) count += n > 0;
        for (size_t k = 0; k < f.calls.size(); ++k)
            if (uses.calls[k]) count += counts[f.calls[k].function];
        counts.push_back(std::min(count, size_t{1} << 40));
    }
    return counts[function];
}

ShaderText shaderText(const SymbolModule& module, const std::vector<ShaderEntry>& entries, Dialect dialect,
                      ShaderTables tables, const ShaderBindings& bindings, ShaderCoordinates coordinates) {
    if (dialect != Dialect::glsl) coordinates = ShaderCoordinates::pairs;
    for (const ShaderEntry& entry : entries)
        if (const size_t count = operationsOf(module, entry.function); count > kMostOperations)
            throw ValueError(
                fmt::format("{} would take {} operations, more than the {} that compilers of shaders cope "
                            "with; use fewer octaves, fields or steps",
                            entry.name, count, kMostOperations));
    const Needed needed(module, entries);
    ShaderText shader{"", module.buffers()};
    Syntax syntax(dialect, coordinates, bindings);
    if (tables == ShaderTables::data)
        for (const size_t width : {1, 4}) addTables(module, needed.tables, width, shader.buffers, syntax);
    std::string body;
    for (const size_t index : needed.functions) body += inner(module, index, syntax);
    for (const ShaderEntry& entry : entries) body += outer(module, entry, syntax);
    if (!shader.buffers.empty()) shader.text += syntax.bufferMacros();
    for (size_t index = 0; index < shader.buffers.size(); ++index)
        shader.text += syntax.buffer(shader.buffers[index], index);
    for (const size_t size : needed.structs) shader.text += syntax.structure(size);
    if (tables == ShaderTables::text)
        for (const size_t index : needed.tables) shader.text += syntax.table(index, module.tables()[index]);
    const std::string preamble = preambleFor(body, dialect, coordinates);
    if (preamble.find("flowZero") != std::string::npos) shader.text += syntax.zero(shader.buffers.size());
    shader.text = translated(shader.text + preamble + body, dialect);
    return shader;
}

} // namespace curlew
