// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <algorithm>
#include <streambuf>
#include <string_view>
#include <vector>

namespace curlew {

/// Reads a file in blocks. Before each block it reports progress to the monitor and throws Interrupted if the monitor
/// asks for it, so that any reader can be cancelled. Seeking inside a block costs nothing.
class WatchedBuffer : public std::streambuf {
  public:
    WatchedBuffer(std::streambuf& source, const Monitor& monitor)
        : mSource(source),
          mMonitor(monitor),
          mSize(source.pubseekoff(0, std::ios::end, std::ios::in)),
          mBlock(size_t(std::clamp<std::streamoff>(mSize, 1, 1 << 18))) {
        source.pubseekpos(0, std::ios::in);
        setg(mBlock.data(), mBlock.data(), mBlock.data());
    }

  protected:
    int_type underflow() override {
        mMonitor.check();
        mBegin += egptr() - eback();
        if (mMonitor.report && mSize > 0)
            mMonitor.report(std::min(1.0, static_cast<double>(mBegin) / static_cast<double>(mSize)));
        const std::streamsize count = mSource.sgetn(mBlock.data(), std::streamsize(mBlock.size()));
        setg(mBlock.data(), mBlock.data(), mBlock.data() + count);
        return count > 0 ? traits_type::to_int_type(mBlock.front()) : traits_type::eof();
    }

    pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode which) override {
        if (from == std::ios::cur) offset += mBegin + (gptr() - eback());
        if (from == std::ios::end) offset += mSize;
        return seekpos(offset, which);
    }

    pos_type seekpos(pos_type position, std::ios::openmode) override {
        const off_type inBlock = off_type(position) - mBegin;
        if (inBlock >= 0 && inBlock <= egptr() - eback()) {
            setg(eback(), eback() + inBlock, egptr());
        } else {
            if (mSource.pubseekpos(position, std::ios::in) == pos_type(off_type(-1))) return pos_type(off_type(-1));
            mBegin = position;
            setg(mBlock.data(), mBlock.data(), mBlock.data());
        }
        return position;
    }

  private:
    std::streambuf& mSource;
    const Monitor& mMonitor;
    std::streamoff mSize, mBegin = 0; ///< Size of the file; position where the block begins.
    std::vector<char> mBlock;
};

/// A stream buffer over bytes that are already in memory.
class BytesBuffer : public std::streambuf {
  public:
    explicit BytesBuffer(std::string_view bytes) {
        char* begin = const_cast<char*>(bytes.data()); // NOLINT: a buffer for reading does not write
        setg(begin, begin, begin + bytes.size());
    }

  protected:
    pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode which) override {
        if (from == std::ios::cur) offset += gptr() - eback();
        if (from == std::ios::end) offset += egptr() - eback();
        return seekpos(offset, which);
    }
    pos_type seekpos(pos_type position, std::ios::openmode) override {
        if (off_type(position) < 0 || off_type(position) > egptr() - eback()) return pos_type(off_type(-1));
        setg(eback(), eback() + off_type(position), egptr());
        return position;
    }
};

} // namespace curlew
