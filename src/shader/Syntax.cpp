// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: how each operation, statement and declaration is written in the four dialects.
#include "Syntax.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace curlew {

namespace {

std::string joined(const std::vector<std::string>& parts, std::string_view separator = ", ") {
    return fmt::format("{}", fmt::join(parts, separator));
}

/// Returns a number that is read back exactly, with a decimal point.
template <class T>
std::string numeral(T x) {
    if (std::isnan(x)) throw ValueError("a constant of the flow is not a number");
    x = std::min(std::max(x, std::numeric_limits<T>::lowest()), std::numeric_limits<T>::max());
    std::string text = fmt::format("{}", x);
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return text;
}

std::string bracketed(const std::string& number) { return number[0] == '-' ? "(" + number + ")" : number; }

std::string vectorName(size_t size) { return size == 1 ? "float" : fmt::format("vec{}", size); }

std::string structureName(size_t results) { return fmt::format("FlowReals{}", results); }

[[noreturn]] void unknown() { throw ValueError("a field needs an operation that shaders do not have"); }

/// The operators that all types of a shader have, or nullptr.
const char* operatorOf(SymbolOp op) {
    switch (op) {
        case SymbolOp::add:
            return "+";
        case SymbolOp::subtract:
            return "-";
        case SymbolOp::multiply:
            return "*";
        case SymbolOp::divide:
            return "/";
        case SymbolOp::less:
            return "<";
        case SymbolOp::lessEqual:
            return "<=";
        case SymbolOp::equal:
            return "==";
        case SymbolOp::both:
            return "&&";
        case SymbolOp::either:
            return "||";
        case SymbolOp::bitAnd:
            return "&";
        case SymbolOp::bitXor:
            return "^";
        default:
            return nullptr;
    }
}

/// The functions of reals. Those that begin with "flow" are in the preamble.
const char* functionOf(SymbolOp op) {
    switch (op) {
        case SymbolOp::floor:
            return "floor";
        case SymbolOp::nearest:
            return "roundEven";
        case SymbolOp::sqrt:
            return "sqrt";
        case SymbolOp::abs:
            return "abs";
        case SymbolOp::min:
            return "min";
        case SymbolOp::max:
            return "max";
        case SymbolOp::sin:
            return "flowSin";
        case SymbolOp::cos:
            return "flowCos";
        case SymbolOp::log:
            return "flowLog";
        case SymbolOp::exp:
            return "flowExp";
        case SymbolOp::asin:
            return "flowAsin";
        case SymbolOp::acos:
            return "flowAcos";
        case SymbolOp::atan:
            return "flowAtan";
        case SymbolOp::sinh:
            return "flowSinh";
        case SymbolOp::cosh:
            return "flowCosh";
        case SymbolOp::tanh:
            return "flowTanh";
        case SymbolOp::power:
            return "flowPow";
        default:
            return nullptr;
    }
}

/// The functions of pairs of floats, all in the preamble.
const char* pairFunctionOf(SymbolOp op) {
    switch (op) {
        case SymbolOp::add:
            return "flowPairAdd";
        case SymbolOp::subtract:
            return "flowPairSub";
        case SymbolOp::multiply:
            return "flowPairMul";
        case SymbolOp::divide:
            return "flowPairDiv";
        case SymbolOp::mulAdd:
            return "flowPairMulAdd";
        case SymbolOp::floor:
            return "flowPairFloor";
        case SymbolOp::nearest:
            return "flowPairNearest";
        case SymbolOp::abs:
            return "flowPairAbs";
        case SymbolOp::min:
            return "flowPairMin";
        case SymbolOp::max:
            return "flowPairMax";
        case SymbolOp::less:
            return "flowPairLess";
        case SymbolOp::lessEqual:
            return "flowPairLessEqual";
        case SymbolOp::equal:
            return "flowPairEqual";
        default:
            return nullptr;
    }
}

} // namespace

std::string_view elementOf(const SymbolBuffer& buffer) {
    if (buffer.type == SymbolType::word) return "uint";
    return buffer.width == 1 ? "float" : "vec4";
}

std::string Syntax::typeName(SymbolType type) const {
    switch (type) {
        case SymbolType::mask:
            return "bool";
        case SymbolType::real:
            return "float";
        case SymbolType::wide:
            return mPairs ? "vec2" : "double";
        case SymbolType::word:
            return "uint";
        case SymbolType::longWord:
            break;
    }
    return "uvec2"; // low, high
}

std::string Syntax::constant(const AnySymbol& constant) const {
    switch (constant.type) {
        case SymbolType::mask:
            return constant.data ? "true" : "false";
        case SymbolType::real:
            return bracketed(numeral(static_cast<float>(constant.number())));
        case SymbolType::wide: {
            if (!mPairs) return bracketed(numeral(constant.number()) + "lf");
            const auto high = static_cast<float>(constant.number());
            return fmt::format("vec2({}, {})", numeral(high),
                               numeral(static_cast<float>(constant.number() - static_cast<double>(high))));
        }
        case SymbolType::word:
            return fmt::format("{}u", constant.data);
        case SymbolType::longWord:
            break;
    }
    return fmt::format("uvec2({}u, {}u)", constant.data & 0xffffffff, constant.data >> 32);
}

std::string Syntax::converted(SymbolType to, SymbolType from, const std::string& x) const {
    if (from == SymbolType::longWord) {
        if (to == SymbolType::word) return x + ".x";
        unknown();
    }
    if (to == SymbolType::longWord) {
        if (from == SymbolType::word) return fmt::format("uvec2({}, 0u)", x);
        unknown();
    }
    if (mPairs && to == SymbolType::wide)
        return from == SymbolType::real ? fmt::format("vec2({}, 0.0)", x) : fmt::format("flowPairOf({})", x);
    if (mPairs && from == SymbolType::wide)
        return to == SymbolType::real ? x + ".x" : fmt::format("flowInteger({}).x", x);
    return fmt::format("{}({})", typeName(to), x);
}

std::string Syntax::wideOperation(const SymbolNode& node, const std::vector<std::string>& x) const {
    if (node.op == SymbolOp::negate) return fmt::format("(-{})", x[0]);
    if (const char* name = pairFunctionOf(node.op)) return fmt::format("{}({})", name, joined(x));
    unknown();
}

std::string Syntax::longOperation(const SymbolNode& node, const std::vector<std::string>& x) const {
    switch (node.op) {
        case SymbolOp::add:
            return fmt::format("flowLongAdd({})", joined(x));
        case SymbolOp::subtract:
            return fmt::format("flowLongSub({})", joined(x));
        case SymbolOp::multiply:
            return fmt::format("flowLongMul({})", joined(x));
        case SymbolOp::bitAnd:
        case SymbolOp::bitXor:
            return fmt::format("({} {} {})", x[0], operatorOf(node.op), x[1]);
        case SymbolOp::shiftLeft: {
            const auto n = node.data;
            if (n == 0) return x[0];
            if (n >= 32) return fmt::format("uvec2(0u, {}.x << {}u)", x[0], n - 32);
            return fmt::format("uvec2({0}.x << {1}u, ({0}.y << {1}u) | ({0}.x >> {2}u))", x[0], n, 32 - n);
        }
        case SymbolOp::shiftRight: {
            const auto n = node.data;
            if (n == 0) return x[0];
            if (n >= 32) return fmt::format("uvec2({}.y >> {}u, 0u)", x[0], n - 32);
            return fmt::format("uvec2(({0}.x >> {1}u) | ({0}.y << {2}u), {0}.y >> {1}u)", x[0], n, 32 - n);
        }
        default:
            unknown();
    }
}

std::string Syntax::operation(const SymbolNode& node, SymbolType from, const std::vector<std::string>& x) const {
    if (node.op == SymbolOp::select)
        return mDialect == Dialect::wgsl ? fmt::format("select({2}, {1}, {0})", x[0], x[1], x[2])
                                         : fmt::format("({} ? {} : {})", x[0], x[1], x[2]);
    if (node.op == SymbolOp::convert) return converted(node.type, from, x[0]);
    if (node.op == SymbolOp::integer)
        return fmt::format("flowInteger({}){}", x[0], node.type == SymbolType::word ? ".x" : "");
    // GPUs add faster than they convert. The sum has the integer in its last bits.
    if (node.op == SymbolOp::index) return fmt::format("(floatBitsToUint({} + 8388608.0) & 0x7fffffu)", x[0]);
    if (node.op == SymbolOp::nearest && mDialect == Dialect::glsl && !(mPairs && from == SymbolType::wide))
        return fmt::format("flowNearest({})", x[0]);
    if (from == SymbolType::longWord) return longOperation(node, x);
    if (mPairs && from == SymbolType::wide) return wideOperation(node, x);
    const bool isDouble = from == SymbolType::wide;
    switch (node.op) {
        case SymbolOp::negate:
            return fmt::format("(-{})", x[0]);
        case SymbolOp::opposite:
            return fmt::format("(!{})", x[0]);
        case SymbolOp::mulAdd:
            return mDialect == Dialect::glsl ? fmt::format("fma({})", joined(x))
                                             : fmt::format("({} * {} + {})", x[0], x[1], x[2]);
        case SymbolOp::shiftLeft:
            return fmt::format("({} << {}u)", x[0], node.data);
        case SymbolOp::shiftRight:
            return fmt::format("({} >> {}u)", x[0], node.data);
        case SymbolOp::modulo:
            return fmt::format("({} % {}u)", x[0], node.data);
        default:
            break;
    }
    if (const char* name = operatorOf(node.op)) return fmt::format("({} {} {})", x[0], name, x[1]);
    const char* name = functionOf(node.op);
    if (!name || (isDouble && std::string_view(name).starts_with("flow"))) unknown();
    return fmt::format("{}({})", name, joined(x));
}

std::string Syntax::variable(SymbolType type, const std::string& name, const std::string& expression) const {
    if (mDialect == Dialect::wgsl) return fmt::format("    let {}: {} = {};\n", name, typeName(type), expression);
    return fmt::format("    {} {} = {};\n", typeName(type), name, expression);
}

std::string Syntax::call(const std::string& name, size_t results, const std::string& function,
                         const std::vector<std::string>& arguments) const {
    const std::string type = mDialect == Dialect::wgsl ? "let" : structureName(results);
    return fmt::format("    {} {} = {}({});\n", type, name, function, joined(arguments));
}

std::string Syntax::structure(size_t results) const {
    const bool isWgsl = mDialect == Dialect::wgsl;
    std::vector<std::string> members;
    for (size_t k = 0; k < results; ++k) members.push_back(fmt::format("r{}{}", k, isWgsl ? ": float" : ""));
    return fmt::format("struct {} {{\n    {}{}{}\n}}{}\n", structureName(results), isWgsl ? "" : "float ",
                       joined(members), isWgsl ? "" : ";", isWgsl ? "" : ";");
}

std::string Syntax::function(const std::string& name, const std::vector<SymbolType>& types,
                             const std::vector<std::string>& parameters, const std::string& statements,
                             const std::vector<std::string>& results) const {
    std::vector<std::string> declared;
    for (size_t k = 0; k < types.size(); ++k) declared.push_back(typeName(types[k]) + " " + parameters[k]);
    const std::string type = structureName(results.size());
    return fmt::format("{} {}({}) {{\n{}{}}}\n", type, name, joined(declared), statements,
                       returned(type, true, results));
}

std::string Syntax::entry(const ShaderEntry& entry, const std::string& statements,
                          const std::vector<std::string>& results) const {
    std::vector<std::string> declared;
    for (const auto& [name, size] : entry.parameters) declared.push_back(vectorName(size) + " " + name);
    const bool isStructure = results.size() > 4;
    const std::string type = isStructure ? structureName(results.size()) : vectorName(results.size());
    return fmt::format("{} {}({}) {{\n{}{}}}\n", type, entry.name, joined(declared), statements,
                       returned(type, isStructure, results));
}

std::string Syntax::returned(const std::string& type, bool isStructure, const std::vector<std::string>& results) const {
    if (isStructure && mDialect == Dialect::hlsl)
        return fmt::format("    {} all = {{{}}};\n    return all;\n", type, joined(results));
    return fmt::format("    return {}({});\n", type, joined(results));
}

std::string Syntax::table(size_t index, const SymbolTable& table) const {
    const size_t rows = table.numbers.size() / table.columns;
    const std::string type = vectorName(table.columns);
    std::string text;
    switch (mDialect) {
        case Dialect::hlsl:
            text = fmt::format("static const {} flowTable{}[{}] = {{", type, index, rows);
            break;
        case Dialect::wgsl:
            text = fmt::format("const flowTable{} = array<{}, {}>(", index, type, rows);
            break;
        default:
            text = fmt::format("const {0} flowTable{1}[{2}] = {0}[{2}](", type, index, rows);
    }
    for (size_t row = 0, length = 0; row < rows; ++row) {
        std::vector<std::string> numbers;
        for (size_t column = 0; column < table.columns; ++column)
            numbers.push_back(numeral(static_cast<float>(table.numbers[row * table.columns + column])));
        const std::string entry = table.columns == 1 ? numbers[0] : fmt::format("{}({})", type, joined(numbers, ","));
        length += entry.size() + 1;
        text += row ? "," : "";
        if (length > 110) {
            text += "\n    ";
            length = entry.size();
        }
        text += entry;
    }
    text += mDialect == Dialect::hlsl ? "};\n" : ");\n";
    // glslang copies a constant array wherever an element is read. With copies at every place of the text, NVIDIA's
    // driver for Vulkan (580) gives up, and those for the processor take minutes.
    return text + fmt::format("{0} flowTable{1}At(uint row) {{\n    return flowTable{1}[row];\n}}\n", type, index);
}

std::string Syntax::tableRow(size_t index, const std::string& row) const {
    const auto data = mTables.find(index);
    if (data == mTables.end()) return fmt::format("flowTable{}At({})", index, row);
    const auto& [buffer, begin] = data->second;
    return bufferElement(buffer, begin == 0 ? row : fmt::format("({} + {}u)", row, begin));
}

std::string Syntax::rowVariable(size_t columns, const std::string& name, const std::string& row) const {
    const std::string type = vectorName(mTables.empty() || columns == 1 ? columns : 4);
    if (mDialect == Dialect::wgsl) return fmt::format("    let {}: {} = {};\n", name, type, row);
    return fmt::format("    {} {} = {};\n", type, name, row);
}

std::string Syntax::bufferMacros() const {
    const std::string places = fmt::format(
        "#ifndef FLOW_BINDING\n#define FLOW_BINDING {}\n#endif\n"
        "#ifndef FLOW_SET\n#define FLOW_SET {}\n#endif\n",
        mBindings.first, mBindings.group);
    switch (mDialect) {
        case Dialect::glsl:
            return places + R"(#ifdef VULKAN
#define FLOW_BUFFER(k) layout(std430, set = FLOW_SET, binding = FLOW_BINDING + k) readonly buffer
#else
#define FLOW_BUFFER(k) layout(std430, binding = FLOW_BINDING + k) readonly buffer
#endif
)";
        case Dialect::hlsl:
            return places + R"(#ifdef VULKAN
#define FLOW_BUFFER(k) [[vk::binding(FLOW_BINDING + k, FLOW_SET)]]
#else
#define FLOW_BUFFER(k)
#endif
)";
        default:
            return {};
    }
}

/// Returns the attributes of a buffer in WGSL.
std::string Syntax::place(size_t buffer) const {
    return fmt::format("@group({}) @binding({})", mBindings.group, mBindings.first + buffer);
}

std::string Syntax::buffer(const SymbolBuffer& buffer, size_t index) const {
    const std::string_view type = elementOf(buffer);
    switch (mDialect) {
        case Dialect::glsl:
            return fmt::format("FLOW_BUFFER({0}) FlowBuffer{0} {{\n    {1} {2}[];\n}};\n", index, type, buffer.name);
        case Dialect::hlsl:
            return fmt::format("FLOW_BUFFER({}) StructuredBuffer<{}> {};\n", index, type, buffer.name);
        case Dialect::wgsl:
            return fmt::format("{} var<storage, read> {}: array<{}>;\n", place(index), buffer.name, type);
        case Dialect::glslEs:
            break;
    }
    return fmt::format("uniform highp {}sampler2D {};\n", buffer.type == SymbolType::word ? "u" : "", buffer.name);
}

std::string Syntax::zero(size_t buffers) const {
    switch (mDialect) {
        case Dialect::glslEs:
            return "uniform uint flowZero; // leave it at 0, which it is unless it is set\n";
        case Dialect::hlsl:
            return "#ifndef flowZero\nuniform uint flowZero; // leave it at 0, which it is unless it is set\n#endif\n";
        case Dialect::wgsl:
            return place(buffers) + " var<uniform> flowZero: uint; // bind a buffer that holds 0\n";
        case Dialect::glsl:
            break;
    }
    return mPairs ? "#ifndef flowZero\n#error define the macro flowZero as an expression that is 0u, such as a member "
                    "of a uniform block\n#endif\n"
                  : "";
}

std::string Syntax::bufferElement(const SymbolBuffer& buffer, const std::string& index) const {
    if (mDialect != Dialect::glslEs) return fmt::format("{}[{}]", buffer.name, index);
    return fmt::format("texelFetch({0}, ivec2(int({1} & 2047u), int({1} >> 11u)), 0){2}", buffer.name, index,
                       buffer.width == 1 ? ".x" : "");
}

} // namespace curlew
