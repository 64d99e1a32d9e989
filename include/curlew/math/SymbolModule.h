// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <deque>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace curlew {

// What a kernel that runs on symbols (Symbol.h) computes is recorded here, as functions of operations on nodes. From
// them, a text in another language is written (shader/ShaderText.h). Equal nodes are one node, and operations on
// constants are carried out at once. x + 0, x * 1, x * 0 and the like are simplified; so 0 * NaN and 0 * infinity give
// 0, unlike for numbers. Constants of reals and of wide numbers are double.

enum class SymbolType : uint8_t { mask, real, wide, word, longWord };

enum class SymbolOp : uint8_t {
    constant,  ///< data: the bits of a double, or the word
    parameter, ///< data: its index
    result,    ///< Of a call. data: index of the call << 32 | index of the result
    table,     ///< A number of a table at the row a. data: index of the table << 32 | column
    buffer,    ///< An element of a buffer at the index a. data: index of the buffer
    add,
    subtract,
    multiply,
    divide,
    negate,
    mulAdd, ///< a b + c
    floor,
    nearest, ///< The nearest integer, halves to even; |a| < 2^22, or 2^51 if it is wide.
    sqrt,
    abs,
    sin,
    cos,
    log,
    exp,
    asin,
    acos,
    atan,
    sinh,
    cosh,
    tanh,
    power, ///< a^b for a > 0
    min,
    max,
    select, ///< a ? b : c
    less,
    lessEqual,
    equal,
    both,
    either,
    opposite,
    bitAnd,
    bitXor,
    shiftLeft, ///< By the number of bits in data.
    shiftRight,
    modulo,  ///< a modulo data
    convert, ///< To the node's type. Words wrap; a real becomes a word if it is an integer from 0 to 2^32 - 1.
    index,   ///< A real that is an integer from 0 to 2^23 - 1, as a word; an arbitrary word for others.
    integer, ///< A wide integer as a longWord, modulo 2^64.
};

struct SymbolNode {
    SymbolOp op;
    SymbolType type;
    std::array<uint32_t, 3> from{}; ///< Operands; unused ones are 0.
    uint64_t data = 0;
    friend auto operator<=>(const SymbolNode&, const SymbolNode&) = default;
};

/// A call of an earlier function of the module.
struct SymbolCall {
    size_t function;
    std::vector<uint32_t> arguments;
    friend bool operator==(const SymbolCall&, const SymbolCall&) = default;
};

class SymbolModule;

/// A recorded function. Nodes refer to earlier nodes only.
struct SymbolFunction {
    SymbolModule* module = nullptr;
    std::string name; ///< Says what the function computes; not unique.
    std::vector<SymbolType> parameters;
    std::vector<SymbolNode> nodes;
    std::vector<SymbolCall> calls;
    std::vector<uint32_t> results;
    std::map<SymbolNode, uint32_t> known; ///< Index of each node; empty once the function is complete.

    uint32_t add(const SymbolNode& node);
};

/// A symbol of any type. Without a function it is a constant.
struct AnySymbol {
    SymbolType type;
    SymbolFunction* function = nullptr;
    uint64_t data = 0; ///< Index of the node, or the bits of the constant.

    bool isConstant() const { return function == nullptr; }
    double number() const { return std::bit_cast<double>(data); }
    friend bool operator==(const AnySymbol&, const AnySymbol&) = default;
};

/// Rows of `columns` numbers each.
struct SymbolTable {
    size_t columns;
    std::vector<double> numbers;
    friend bool operator==(const SymbolTable&, const SymbolTable&) = default;
};

/// Elements that are too many to be written into a text: words of 32 bits, or floats.
struct SymbolBuffer {
    std::string name;                                  ///< Assigned by the module.
    SymbolType type;                                   ///< word or real
    std::shared_ptr<const std::vector<uint32_t>> data; ///< The words, or the bits of the floats.
    size_t width = 1;                                  ///< Numbers of an element: 1, or 4 reals (rows of tables).
};

/// The functions that belong together, with their tables and buffers. Not safe to share between threads.
class SymbolModule {
  public:
    using Symbols = std::vector<AnySymbol>;
    using Body = std::function<Symbols(const Symbols& parameters)>;

    SymbolModule() = default;
    SymbolModule(const SymbolModule&) = delete;
    SymbolModule& operator=(const SymbolModule&) = delete;

    /// Records a function of parameters of these types, and returns its index. Functions with equal content are one.
    size_t record(const std::string& name, const std::vector<SymbolType>& parameters, const Body& body);

    /// Records a function only once for each owner and kind, and returns its index. Keeps the owner alive.
    size_t recordOnce(const std::shared_ptr<const void>& owner, int kind, const std::string& name,
                      const std::vector<SymbolType>& parameters, const Body& body);

    /// Calls a function from the one that is being recorded. A constant result becomes a constant.
    Symbols call(size_t function, const Symbols& arguments);

    /// Returns a number of the table for each of the first `count` columns, at a row that is a word.
    Symbols lookUp(SymbolTable table, const AnySymbol& row, size_t count);

    /// Returns the element at an index that is a word.
    AnySymbol load(const SymbolBuffer& buffer, const AnySymbol& index);

    const std::deque<SymbolFunction>& functions() const { return mFunctions; }
    const std::vector<SymbolTable>& tables() const { return mTables; }
    const std::vector<SymbolBuffer>& buffers() const { return mBuffers; }

  private:
    std::deque<SymbolFunction> mFunctions;
    std::vector<std::unique_ptr<SymbolFunction>> mOpen; // being recorded, the innermost last
    std::vector<SymbolTable> mTables;
    std::vector<SymbolBuffer> mBuffers;
    std::map<std::pair<const void*, int>, size_t> mRecorded;
    std::vector<std::shared_ptr<const void>> mOwners;
};

/// Records an operation of up to three operands, or carries it out if all operands are constants.
AnySymbol recorded(SymbolOp op, SymbolType type, std::initializer_list<AnySymbol> operands, uint64_t data = 0);

/// Carries out an operation on numbers: those of the types real, wide and mask (1 or 0), except convert.
template <class T>
T applied(SymbolOp op, T a, T b, T c);
/// The same for words.
uint64_t applied(SymbolOp op, uint64_t a, uint64_t b, uint64_t data);

} // namespace curlew
