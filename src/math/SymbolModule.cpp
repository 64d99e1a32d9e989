// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/SymbolModule.h"

#include "curlew/math/Arithmetic.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace curlew {

namespace {

constexpr bool isNumber(SymbolType type) { return type == SymbolType::real || type == SymbolType::wide; }

uint64_t bits(double x) { return std::bit_cast<uint64_t>(x); }

/// Returns whether a symbol is this constant.
bool is(const AnySymbol& a, int constant) {
    if (!a.isConstant()) return false;
    return isNumber(a.type) ? a.number() == constant : a.data == static_cast<uint64_t>(constant);
}

AnySymbol constantOf(SymbolType type, int number) {
    return {type, nullptr, isNumber(type) ? bits(number) : static_cast<uint64_t>(number)};
}

AnySymbol converted(const AnySymbol& a, SymbolType type) {
    uint64_t word = a.data;
    if (isNumber(a.type)) {
        if (isNumber(type)) return {type, nullptr, a.data};
        word = wordOf(a.number());
    } else if (isNumber(type)) {
        return {type, nullptr, bits(static_cast<double>(a.data))};
    }
    return {type, nullptr, type == SymbolType::word ? word & 0xffffffff : word};
}

/// Carries out an operation on constants.
AnySymbol carriedOut(SymbolOp op, SymbolType type, const std::vector<AnySymbol>& of, uint64_t data) {
    if (op == SymbolOp::convert || op == SymbolOp::index || op == SymbolOp::integer) return converted(of[0], type);
    const auto operand = [&of](size_t k) { return k < of.size() ? of[k] : AnySymbol{of[0].type}; };
    if (!isNumber(of[0].type) && of[0].type != SymbolType::mask) {
        const uint64_t word = applied(op, of[0].data, operand(1).data, data);
        return {type, nullptr, type == SymbolType::word ? word & 0xffffffff : word};
    }
    const auto number = [&](size_t k) {
        const AnySymbol x = operand(k);
        return x.type == SymbolType::mask ? static_cast<double>(x.data) : x.number();
    };
    const double result = applied(op, number(0), number(1), number(2));
    return {type, nullptr, type == SymbolType::mask ? uint64_t{result != 0} : bits(result)};
}

const SymbolNode* nodeOf(const AnySymbol& a) {
    return a.isConstant() ? nullptr : &a.function->nodes[static_cast<size_t>(a.data)];
}

bool commutes(SymbolOp op) {
    return op == SymbolOp::add || op == SymbolOp::multiply || op == SymbolOp::both || op == SymbolOp::either ||
           op == SymbolOp::bitAnd || op == SymbolOp::bitXor || op == SymbolOp::equal;
}

/// Returns what an operation with some constant operands comes to, if that is known.
std::optional<AnySymbol> simplified(SymbolOp op, SymbolType type, const std::vector<AnySymbol>& of) {
    const AnySymbol& a = of[0];
    switch (op) {
        case SymbolOp::add:
            if (is(a, 0)) return of[1];
            if (is(of[1], 0)) return a;
            break;
        case SymbolOp::subtract:
            if (is(of[1], 0)) return a;
            if (is(a, 0) && isNumber(type)) return recorded(SymbolOp::negate, type, {of[1]});
            break;
        case SymbolOp::multiply:
            for (size_t k = 0; k < 2; ++k) {
                if (is(of[k], 0)) return constantOf(type, 0);
                if (is(of[k], 1)) return of[1 - k];
                if (isNumber(type) && is(of[k], -1)) return recorded(SymbolOp::negate, type, {of[1 - k]});
            }
            break;
        case SymbolOp::divide:
            if (is(of[1], 1)) return a;
            if (is(a, 0)) return a;
            break;
        case SymbolOp::mulAdd: {
            const auto plain = [](const AnySymbol& x) { return is(x, 0) || is(x, 1) || is(x, -1); };
            if (plain(a) || plain(of[1]) || is(of[2], 0) || (a.isConstant() && of[1].isConstant()))
                return recorded(SymbolOp::add, type, {recorded(SymbolOp::multiply, type, {a, of[1]}), of[2]});
            break;
        }
        case SymbolOp::negate:
            if (const SymbolNode* node = nodeOf(a); node && node->op == SymbolOp::negate)
                return AnySymbol{type, a.function, node->from[0]};
            break;
        case SymbolOp::select:
            if (a.isConstant()) return a.data ? of[1] : of[2];
            if (of[1] == of[2]) return of[1];
            break;
        case SymbolOp::both:
        case SymbolOp::either:
            for (size_t k = 0; k < 2; ++k)
                if (of[k].isConstant()) return (of[k].data != 0) == (op == SymbolOp::both) ? of[1 - k] : of[k];
            break;
        case SymbolOp::opposite:
            if (const SymbolNode* node = nodeOf(a); node && node->op == SymbolOp::opposite)
                return AnySymbol{type, a.function, node->from[0]};
            break;
        case SymbolOp::convert:
            if (const SymbolNode* node = nodeOf(a)) {
                if (type == SymbolType::word && node->op == SymbolOp::integer)
                    return recorded(SymbolOp::integer, type, {{SymbolType::wide, a.function, node->from[0]}});
                const bool back = node->op == SymbolOp::convert && a.type == SymbolType::wide &&
                                  type == SymbolType::real && a.function->nodes[node->from[0]].type == type;
                if (back) return AnySymbol{type, a.function, node->from[0]};
            }
            break;
        default:
            break;
    }
    return {};
}

} // namespace

template <class T>
T applied(SymbolOp op, T a, T b, T c) {
    switch (op) {
        case SymbolOp::add:
            return a + b;
        case SymbolOp::subtract:
            return a - b;
        case SymbolOp::multiply:
            return a * b;
        case SymbolOp::divide:
            return a / b;
        case SymbolOp::negate:
            return -a;
        case SymbolOp::mulAdd:
            return mulAdd(a, b, c);
        case SymbolOp::floor:
            return floor(a);
        case SymbolOp::nearest:
            return std::nearbyint(a);
        case SymbolOp::sqrt:
            return sqrt(a);
        case SymbolOp::abs:
            return abs(a);
        case SymbolOp::sin:
            return sin(a);
        case SymbolOp::cos:
            return cos(a);
        case SymbolOp::log:
            return log(a);
        case SymbolOp::exp:
            return exp(a);
        case SymbolOp::asin:
            return asin(a);
        case SymbolOp::acos:
            return acos(a);
        case SymbolOp::atan:
            return atan(a);
        case SymbolOp::sinh:
            return sinh(a);
        case SymbolOp::cosh:
            return cosh(a);
        case SymbolOp::tanh:
            return tanh(a);
        case SymbolOp::power:
            return pow(a, b);
        case SymbolOp::min:
            return min(a, b);
        case SymbolOp::max:
            return max(a, b);
        case SymbolOp::select:
            return a != 0 ? b : c;
        case SymbolOp::less:
            return T(a < b);
        case SymbolOp::lessEqual:
            return T(a <= b);
        case SymbolOp::equal:
            return T(a == b);
        case SymbolOp::both:
            return T(a != 0 && b != 0);
        case SymbolOp::either:
            return T(a != 0 || b != 0);
        case SymbolOp::opposite:
            return T(a == 0);
        default:
            throw std::logic_error("not an operation on numbers");
    }
}
template float applied(SymbolOp, float, float, float);
template double applied(SymbolOp, double, double, double);

uint64_t applied(SymbolOp op, uint64_t a, uint64_t b, uint64_t data) {
    switch (op) {
        case SymbolOp::add:
            return a + b;
        case SymbolOp::subtract:
            return a - b;
        case SymbolOp::multiply:
            return a * b;
        case SymbolOp::min:
            return std::min(a, b);
        case SymbolOp::max:
            return std::max(a, b);
        case SymbolOp::less:
            return a < b;
        case SymbolOp::lessEqual:
            return a <= b;
        case SymbolOp::equal:
            return a == b;
        case SymbolOp::bitAnd:
            return a & b;
        case SymbolOp::bitXor:
            return a ^ b;
        case SymbolOp::shiftLeft:
            return a << data;
        case SymbolOp::shiftRight:
            return a >> data;
        case SymbolOp::modulo:
            return a % data;
        default:
            throw std::logic_error("not an operation on words");
    }
}

uint32_t SymbolFunction::add(const SymbolNode& node) {
    const auto [place, added] = known.try_emplace(node, static_cast<uint32_t>(nodes.size()));
    if (added) nodes.push_back(node);
    return place->second;
}

namespace {

/// Returns the node of a symbol in the function; a constant becomes one.
uint32_t placed(SymbolFunction& function, const AnySymbol& a) {
    if (!a.isConstant()) return static_cast<uint32_t>(a.data);
    return function.add({SymbolOp::constant, a.type, {}, a.data});
}

} // namespace

AnySymbol recorded(SymbolOp op, SymbolType type, std::initializer_list<AnySymbol> operands, uint64_t data) {
    std::vector<AnySymbol> of(operands);
    SymbolFunction* function = nullptr;
    for (const AnySymbol& a : of)
        if (!a.isConstant()) function = a.function;
    if (!function && op != SymbolOp::select) return carriedOut(op, type, of, data);
    if (const auto known = simplified(op, type, of)) return *known;
    SymbolNode node{op, type, {}, data};
    for (size_t k = 0; k < of.size(); ++k) node.from[k] = placed(*function, of[k]);
    if (commutes(op) && node.from[1] < node.from[0]) std::swap(node.from[0], node.from[1]);
    return {type, function, function->add(node)};
}

size_t SymbolModule::record(const std::string& name, const std::vector<SymbolType>& parameters, const Body& body) {
    mOpen.push_back(std::make_unique<SymbolFunction>());
    SymbolFunction& function = *mOpen.back();
    function.module = this;
    function.name = name;
    function.parameters = parameters;
    Symbols symbols;
    for (size_t k = 0; k < parameters.size(); ++k)
        symbols.push_back(
            {parameters[k], &function, function.add({SymbolOp::parameter, parameters[k], {}, uint64_t{k}})});
    for (const AnySymbol& result : body(symbols)) function.results.push_back(placed(function, result));
    function.known.clear();
    const auto same = std::find_if(mFunctions.begin(), mFunctions.end(), [&](const SymbolFunction& other) {
        return other.parameters == function.parameters && other.results == function.results &&
               other.nodes == function.nodes && other.calls == function.calls;
    });
    const auto index = static_cast<size_t>(same - mFunctions.begin());
    if (same == mFunctions.end()) mFunctions.push_back(std::move(function));
    mOpen.pop_back();
    return index;
}

size_t SymbolModule::recordOnce(const std::shared_ptr<const void>& owner, int kind, const std::string& name,
                                const std::vector<SymbolType>& parameters, const Body& body) {
    const std::pair key{owner.get(), kind};
    if (const auto known = mRecorded.find(key); known != mRecorded.end()) return known->second;
    const size_t index = record(name, parameters, body);
    mOwners.push_back(owner);
    mRecorded.emplace(key, index);
    return index;
}

SymbolModule::Symbols SymbolModule::call(size_t function, const Symbols& arguments) {
    SymbolFunction& caller = *mOpen.back();
    const SymbolFunction& callee = mFunctions[function];
    SymbolCall call{function, {}};
    for (const AnySymbol& argument : arguments) call.arguments.push_back(placed(caller, argument));
    const auto known = std::find(caller.calls.begin(), caller.calls.end(), call);
    const auto index = static_cast<uint64_t>(known - caller.calls.begin());
    if (known == caller.calls.end()) caller.calls.push_back(call);
    Symbols results;
    for (size_t k = 0; k < callee.results.size(); ++k) {
        const SymbolNode& result = callee.nodes[callee.results[k]];
        if (result.op == SymbolOp::constant)
            results.push_back({result.type, nullptr, result.data});
        else
            results.push_back(
                {result.type, &caller, caller.add({SymbolOp::result, result.type, {}, index << 32 | uint64_t{k}})});
    }
    return results;
}

SymbolModule::Symbols SymbolModule::lookUp(SymbolTable table, const AnySymbol& row, size_t count) {
    const auto known = std::find(mTables.begin(), mTables.end(), table);
    const auto index = static_cast<uint64_t>(known - mTables.begin());
    if (known == mTables.end()) mTables.push_back(std::move(table));
    Symbols numbers;
    for (size_t column = 0; column < count; ++column)
        numbers.push_back(recorded(SymbolOp::table, SymbolType::real, {row}, index << 32 | uint64_t{column}));
    return numbers;
}

AnySymbol SymbolModule::load(const SymbolBuffer& buffer, const AnySymbol& index) {
    const auto known = std::find_if(mBuffers.begin(), mBuffers.end(), [&](const SymbolBuffer& b) {
        return b.type == buffer.type && (b.data == buffer.data || *b.data == *buffer.data);
    });
    const auto number = static_cast<uint64_t>(known - mBuffers.begin());
    if (known == mBuffers.end()) mBuffers.push_back({"flowData" + std::to_string(number), buffer.type, buffer.data});
    return recorded(SymbolOp::buffer, buffer.type, {index}, number);
}

} // namespace curlew
