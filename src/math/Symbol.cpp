// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/Symbol.h"

namespace curlew {

template <class T>
Symbol<T> Symbol<T>::of(SymbolOp op, const Symbol& a) {
    return Symbol(recorded(op, kSymbolType<T>, {a.any()}));
}
template <class T>
Symbol<T> Symbol<T>::of(SymbolOp op, const Symbol& a, const Symbol& b) {
    return Symbol(recorded(op, kSymbolType<T>, {a.any(), b.any()}));
}
template <class T>
Symbol<T> Symbol<T>::of(SymbolOp op, const Symbol& a, const Symbol& b, const Symbol& c) {
    return Symbol(recorded(op, kSymbolType<T>, {a.any(), b.any(), c.any()}));
}
template <class T>
Symbol<bool> Symbol<T>::compared(SymbolOp op, const Symbol& a, const Symbol& b) {
    return Symbol<bool>(recorded(op, SymbolType::mask, {a.any(), b.any()}));
}
template <class T>
Symbol<T> Symbol<T>::selected(const Symbol<bool>& mask, const Symbol& yes, const Symbol& no) {
    return Symbol(recorded(SymbolOp::select, kSymbolType<T>, {mask.any(), yes.any(), no.any()}));
}
template <class T>
Symbol<T> Symbol<T>::shifted(SymbolOp op, const Symbol& a, int bits) {
    return Symbol(recorded(op, kSymbolType<T>, {a.any()}, static_cast<uint64_t>(bits)));
}

template class Symbol<bool>;
template class Symbol<float>;
template class Symbol<double>;
template class Symbol<uint32_t>;
template class Symbol<uint64_t>;

std::vector<AnySymbol> lookUp(SymbolTable table, const Symbol<uint32_t>& row, size_t count) {
    const AnySymbol at = row.any();
    if (!at.isConstant()) return at.function->module->lookUp(std::move(table), at, count);
    std::vector<AnySymbol> numbers;
    for (size_t column = 0; column < count; ++column)
        numbers.push_back(
            {SymbolType::real, nullptr, std::bit_cast<uint64_t>(table.numbers[at.data * table.columns + column])});
    return numbers;
}

} // namespace curlew
