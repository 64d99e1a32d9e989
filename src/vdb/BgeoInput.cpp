// SPDX-License-Identifier: Apache-2.0
#include "BgeoInput.h"

#include "curlew/base/InputFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <ios>

namespace curlew {

namespace {

constexpr size_t kWindow = size_t{1} << 18;

} // namespace

BgeoInput::BgeoInput(const std::filesystem::path& path) : mPath(path), mIn(openToRead(path)) {
    mSize = static_cast<size_t>(mIn.seekg(0, std::ios::end).tellg());
    moveTo(0);
}

void BgeoInput::copy(char* to, size_t count) {
    if (count > left()) throw cutShort();
    moveTo(position());
    readTo(to, count);
}

void BgeoInput::skipFar(size_t count) {
    if (count > left()) throw cutShort();
    moveTo(position() + count);
}

void BgeoInput::moveTo(size_t position) {
    mWindow.clear();
    mNext = 0;
    mEnd = position;
    mIn.seekg(static_cast<std::streamoff>(position));
}

size_t BgeoInput::count() {
    const auto number = read<int32_t>();
    if (number < 0) throw error("it is damaged; write or copy it again");
    return static_cast<size_t>(number);
}

std::string BgeoInput::text() {
    const auto size = read<int16_t>();
    if (size < -1) throw error("it is damaged; write or copy it again");
    return std::string(bytes(size == -1 ? count() : static_cast<size_t>(size)));
}

FileError BgeoInput::error(std::string_view what) const {
    return FileError(fmt::format("'{}' cannot be read as a .bgeo: {}", mPath.string(), what));
}

void BgeoInput::refill(size_t count) {
    if (count > left()) throw cutShort();
    mWindow.erase(0, mNext);
    mNext = 0;
    const size_t had = mWindow.size();
    mWindow.resize(std::max(count, std::min(kWindow, had + mSize - mEnd)));
    readTo(mWindow.data() + had, mWindow.size() - had);
}

void BgeoInput::readTo(char* to, size_t count) {
    try {
        mIn.read(to, static_cast<std::streamsize>(count));
    } catch (const std::ios_base::failure&) {
        throw error("only part of it could be read; copy it again");
    }
    mEnd += count;
}

} // namespace curlew
