// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew::test {

/// Runs recorded functions. Real is the type of values (float or double); coordinates are double, as on the processor.
template <class Real>
class SymbolInterpreter {
  public:
    explicit SymbolInterpreter(const SymbolModule& module) : mModule(module) {}

    std::vector<double> run(size_t function, const std::vector<double>& arguments) const {
        std::vector<Value> values;
        for (const double argument : arguments) values.push_back({argument, 0});
        std::vector<double> numbers;
        for (const Value& result : called(function, values)) numbers.push_back(result.number);
        return numbers;
    }

  private:
    struct Value {
        double number = 0;
        uint64_t word = 0;
    };

    static double rounded(SymbolType type, double x) {
        return type == SymbolType::real ? static_cast<double>(static_cast<Real>(x)) : x;
    }
    static bool isWord(SymbolType type) { return type == SymbolType::word || type == SymbolType::longWord; }
    static uint64_t wrapped(SymbolType type, uint64_t word) {
        return type == SymbolType::word ? word & 0xffffffff : word;
    }

    std::vector<Value> called(size_t index, const std::vector<Value>& arguments) const {
        const SymbolFunction& function = mModule.functions()[index];
        std::vector<std::vector<Value>> calls(function.calls.size());
        std::vector<Value> values;
        for (const SymbolNode& node : function.nodes)
            values.push_back(valueOf(function, node, arguments, values, calls));
        std::vector<Value> results;
        for (const uint32_t result : function.results) results.push_back(values[result]);
        return results;
    }

    Value valueOf(const SymbolFunction& function, const SymbolNode& node, const std::vector<Value>& arguments,
                  const std::vector<Value>& values, std::vector<std::vector<Value>>& calls) const {
        const Value &a = values.empty() ? Value{} : values[node.from[0]],
                    &b = values.empty() ? a : values[node.from[1]];
        const SymbolType from = function.nodes[node.from[0]].type;
        const auto high = static_cast<size_t>(node.data >> 32), low = static_cast<size_t>(node.data & 0xffffffff);
        switch (node.op) {
            case SymbolOp::constant:
                if (isWord(node.type)) return {0, node.data};
                if (node.type == SymbolType::mask) return {static_cast<double>(node.data), 0};
                return {rounded(node.type, std::bit_cast<double>(node.data)), 0};
            case SymbolOp::parameter:
                return arguments[low];
            case SymbolOp::result:
                if (calls[high].empty()) {
                    const SymbolCall& call = function.calls[high];
                    std::vector<Value> given;
                    for (const uint32_t argument : call.arguments) given.push_back(values[argument]);
                    calls[high] = called(call.function, given);
                }
                return calls[high][low];
            case SymbolOp::table: {
                const SymbolTable& table = mModule.tables()[high];
                return {rounded(SymbolType::real, table.numbers[static_cast<size_t>(a.word) * table.columns + low]), 0};
            }
            case SymbolOp::buffer: {
                const uint32_t bits = (*mModule.buffers()[low].data)[static_cast<size_t>(a.word)];
                if (node.type == SymbolType::word) return {0, bits};
                return {static_cast<double>(std::bit_cast<float>(bits)), 0};
            }
            case SymbolOp::index:
            case SymbolOp::integer:
                return {0, wrapped(node.type, wordOf(a.number))};
            case SymbolOp::convert:
                if (isWord(from)) return {rounded(node.type, static_cast<double>(a.word)), wrapped(node.type, a.word)};
                return {rounded(node.type, a.number), wrapped(node.type, wordOf(a.number))};
            case SymbolOp::select:
                return a.number != 0 ? b : values[node.from[2]];
            default:
                break;
        }
        if (isWord(from)) {
            const uint64_t word = applied(node.op, a.word, b.word, node.data);
            return {static_cast<double>(word), wrapped(node.type, word)};
        }
        const double c = values[node.from[2]].number;
        if (from == SymbolType::wide) return {applied(node.op, a.number, b.number, c), 0};
        return {static_cast<double>(
                    applied(node.op, static_cast<Real>(a.number), static_cast<Real>(b.number), static_cast<Real>(c))),
                0};
    }

    const SymbolModule& mModule;
};

/// Records a field, and returns the index of its function of the position.
template <int Order, int N>
size_t recordField(SymbolModule& module, const ScalarFieldN<N>& field) {
    const std::vector types(size_t{N}, SymbolType::wide);
    return module.record("value", types, [&](const SymbolModule::Symbols& parameters) {
        Vec<Symbol<double>, N> p;
        const AnySymbol* next = parameters.data();
        detail::take(next, p);
        SymbolModule::Symbols results;
        detail::append(results, field.template symbols<Order>(module, p));
        return results;
    });
}

/// The largest differences of a recorded field from the field, relative to root mean squares.
struct SymbolErrors {
    double value = 0, gradient = 0;
};

template <class Real, int N>
SymbolErrors symbolErrors(const ScalarFieldN<N>& field, const BoxN<N>& box, size_t count, uint64_t seed) {
    SymbolModule module;
    const size_t function = recordField<1>(module, field);
    const SymbolInterpreter<Real> interpreter(module);
    double value2 = 0, gradient2 = 0;
    SymbolErrors most;
    for (size_t k = 0; k < count; ++k) {
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis)
            p[axis] = box.lower[axis] + box.size()[axis] * randomUniform(seed, k, static_cast<uint64_t>(axis));
        const auto expected = field.template at<1, Real>(p);
        const auto found = interpreter.run(function, {p.c.begin(), p.c.end()});
        most.value = std::max(most.value, std::abs(found[0] - static_cast<double>(expected.value)));
        value2 += static_cast<double>(expected.value) * static_cast<double>(expected.value);
        for (int axis = 0; axis < N; ++axis) {
            const auto g = static_cast<double>(expected.gradient[axis]);
            most.gradient = std::max(most.gradient, std::abs(found[static_cast<size_t>(axis) + 1] - g));
            gradient2 += g * g;
        }
    }
    const auto number = static_cast<double>(count);
    return {most.value / std::sqrt(value2 / number), most.gradient / std::sqrt(gradient2 / number)};
}

} // namespace curlew::test
