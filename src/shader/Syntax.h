// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/shader/ShaderText.h"

#include <map>

namespace curlew {

/// Returns what a buffer consists of: "uint", "float" or "vec4".
std::string_view elementOf(const SymbolBuffer& buffer);

/// The expressions, statements and declarations of a dialect, with the words of GLSL where translated() knows them.
class Syntax {
  public:
    Syntax(Dialect dialect, ShaderCoordinates coordinates, const ShaderBindings& bindings)
        : mDialect(dialect), mPairs(coordinates == ShaderCoordinates::pairs), mBindings(bindings) {}

    /// Puts a table into a buffer, from an element on. Without this, it is in the text.
    void putTable(size_t index, const SymbolBuffer& buffer, size_t begin) { mTables[index] = {buffer, begin}; }

    std::string constant(const AnySymbol& constant) const;
    /// x are the operands; `from` is the type of the first one.
    std::string operation(const SymbolNode& node, SymbolType from, const std::vector<std::string>& x) const;
    std::string variable(SymbolType type, const std::string& name, const std::string& expression) const;
    /// Declares `name` as the structure of the results of a call.
    std::string call(const std::string& name, size_t results, const std::string& function,
                     const std::vector<std::string>& arguments) const;

    std::string structure(size_t results) const;
    std::string function(const std::string& name, const std::vector<SymbolType>& types,
                         const std::vector<std::string>& parameters, const std::string& statements,
                         const std::vector<std::string>& results) const;
    std::string entry(const ShaderEntry& entry, const std::string& statements,
                      const std::vector<std::string>& results) const;

    std::string table(size_t index, const SymbolTable& table) const;
    std::string tableRow(size_t index, const std::string& row) const;
    /// Declares `name` as a row of a table with so many columns.
    std::string rowVariable(size_t columns, const std::string& name, const std::string& row) const;
    std::string bufferMacros() const;
    std::string buffer(const SymbolBuffer& buffer, size_t index) const;
    /// Declares the number 0 that compilers do not know, which pairs of floats need. `buffers`: their number.
    std::string zero(size_t buffers) const;
    std::string bufferElement(const SymbolBuffer& buffer, const std::string& index) const;

  private:
    std::string typeName(SymbolType type) const;
    std::string place(size_t buffer) const;
    std::string wideOperation(const SymbolNode& node, const std::vector<std::string>& x) const;
    std::string longOperation(const SymbolNode& node, const std::vector<std::string>& x) const;
    std::string converted(SymbolType to, SymbolType from, const std::string& x) const;
    std::string returned(const std::string& type, bool isStructure, const std::vector<std::string>& results) const;

    Dialect mDialect;
    bool mPairs; ///< Coordinates are pairs of floats.
    ShaderBindings mBindings;
    struct TableData {
        SymbolBuffer buffer;
        size_t begin; ///< Its first element.
    };
    std::map<size_t, TableData> mTables; ///< Those that are not in the text.
};

} // namespace curlew
