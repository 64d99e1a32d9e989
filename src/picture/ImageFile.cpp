// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ImageFile.h"

#include "PictureValidation.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/picture/Display.h"

#include <OpenEXR/Iex.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTestFile.h>
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

namespace curlew {

namespace {

namespace fs = std::filesystem;

FileError cannotRead(const fs::path& path, std::string_view reason) {
    return FileError(fmt::format("cannot read '{}': {}", path.string(), reason));
}

FileError cannotWrite(const fs::path& path, std::string_view reason) {
    return FileError(fmt::format("cannot write '{}': {}", path.string(), reason));
}

uintmax_t fileSize(const fs::path& path) {
    std::error_code error;
    const uintmax_t size = fs::file_size(path, error);
    if (error) throw cannotRead(path, error.message());
    return size;
}

png_byte displayByte(float value, float ifNan) {
    const float display = std::isnan(value) ? ifNan : std::clamp(value, 0.0f, 1.0f);
    return static_cast<png_byte>(std::lround(display * 255));
}

bool isRgb(const Image& image) { return image.channels == std::vector<std::string>{"R", "G", "B"}; }

std::vector<png_byte> displayBytes(const Image& image, const ColorScale& scale, const Monitor& monitor) {
    const auto bytesOf = [&](const Image& rgb) {
        std::vector<png_byte> bytes(rgb.pixels.size());
        parallelFor(
            bytes.size(), 1 << 14,
            [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i)
                    bytes[i] = displayByte(rgb.pixels[i], kNoValueColor[static_cast<int>(i % 3)]);
            },
            monitor);
        return bytes;
    };
    return isRgb(image) ? bytesOf(image) : bytesOf(displayed(image, scale));
}

/// libpng's image structure, freed on destruction.
struct PngImage : png_image {
    PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
    ~PngImage() { png_image_free(this); }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;
};

/// libpng's simplified interface counts bytes in 31 bits.
constexpr uintmax_t kMaxPngBytes = 0x7fffffff;

uintmax_t rgbBytes(uintmax_t width, uintmax_t height) { return width * height * 3; }

std::ifstream opened(const fs::path& path) {
    if (fileSize(path) == 0) throw cannotRead(path, "it is empty");
    errno = 0;
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw cannotRead(path, std::strerror(errno));
    return stream;
}

std::string readBytes(const fs::path& path) {
    std::ifstream stream = opened(path);
    requireMemory(double(fileSize(path)), fmt::format("'{}'", path.string()), "make it smaller");
    std::string bytes(fileSize(path), '\0');
    if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        throw cannotRead(path, "it is shorter than expected; is it still being written?");
    return bytes;
}

/// The stream that libpng reads from or writes to. It also serves to cancel libpng, which has no other hook for that.
struct PngStream {
    std::string_view left = {}; ///< Remaining input.
    std::string written = {};
    const std::function<bool()>& cancelled;

    bool stopped() const { return cancelled && cancelled(); }

    static ssize_t read(void* cookie, char* to, size_t size) {
        auto& stream = *static_cast<PngStream*>(cookie);
        if (stream.stopped()) return -1;
        size = stream.left.copy(to, size);
        stream.left.remove_prefix(size);
        return static_cast<ssize_t>(size);
    }
    static ssize_t write(void* cookie, const char* from, size_t size) {
        auto& stream = *static_cast<PngStream*>(cookie);
        if (stream.stopped()) return 0;
        stream.written.append(from, size);
        return static_cast<ssize_t>(size);
    }

    using File = std::unique_ptr<FILE, int (*)(FILE*)>;
    File file(const char* mode) {
        File opened(fopencookie(this, mode, {.read = read, .write = write, .seek = nullptr, .close = nullptr}), fclose);
        if (!opened) throw ResourceError(fmt::format("cannot open a stream in memory: {}", std::strerror(errno)));
        return opened;
    }
};

/// Lets OpenEXR write to our stream. OpenEXR also writes and seeks in destructors, where an exception would end the
/// program. So seeking never throws, and once the stream has failed it stays failed, for the caller to check.
class ExrStream : public Imf::OStream {
  public:
    ExrStream(std::ostream& stream, const fs::path& path) : OStream(path.c_str()), mStream(stream) {
        mStream.exceptions(std::ios::goodbit);
    }
    void write(const char* bytes, int count) override {
        if (!mStream.write(bytes, count)) throw std::ios_base::failure("write");
    }
    uint64_t tellp() override { return static_cast<uint64_t>(static_cast<std::streamoff>(mStream.tellp())); }
    void seekp(uint64_t position) override { mStream.seekp(static_cast<std::streamoff>(position)); }

  private:
    std::ostream& mStream;
};

/// Returns OpenEXR's message on one line, without the file name at its start.
std::string reasonOf(const std::exception& exception) {
    std::string reason = exception.what();
    if (const size_t name = reason.find("\". "); name != std::string::npos) reason.erase(0, name + 3);
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    return reason;
}

/// Describes one channel of interleaved pixels to OpenEXR.
template <class Value>
Imf::Slice sliceOf(Value* first, const Imath::Box2i& window, size_t channels) {
    const size_t step = channels * sizeof(Value);
    const auto width = static_cast<size_t>(window.max.x) - static_cast<size_t>(window.min.x) + 1;
    return Imf::Slice::Make(std::is_same_v<std::remove_const_t<Value>, half> ? Imf::HALF : Imf::FLOAT, first, window,
                            step, step * width);
}

/// Returns the image with R, G and B mapped through a curve.
Image withColors(Image image, double (*curve)(double), const Monitor& monitor) {
    const auto places = rgbChannels(image);
    if (!places) return image;
    const size_t count = image.channels.size();
    parallelFor(
        image.pixels.size() / count, 1 << 14,
        [&](size_t begin, size_t end) {
            for (size_t pixel = begin; pixel < end; ++pixel)
                for (const size_t place : *places) {
                    float& value = image.pixels[pixel * count + place];
                    if (!std::isnan(value)) value = static_cast<float>(curve(static_cast<double>(value)));
                }
        },
        monitor);
    return image;
}

/// Depth is never stored as half.
bool storedAsHalf(const std::string& channel, const ExrOptions& options) { return options.half && channel != "Z"; }

/// Rounds to half; finite values stay finite.
std::vector<half> halves(const std::vector<float>& values, const Monitor& monitor) {
    std::vector<half> rounded(values.size());
    const auto roundedOf = [](float value) {
        return half(std::isinf(value) ? value : std::clamp(value, -float(HALF_MAX), float(HALF_MAX)));
    };
    parallelFor(
        values.size(), 1 << 14,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) rounded[k] = roundedOf(values[k]);
        },
        monitor);
    return rounded;
}

void sortChannels(std::vector<std::string>& names) {
    constexpr std::string_view colors = "RGBA";
    const auto rank = [&](const std::string& name) {
        return name.size() == 1 ? colors.find(name[0]) : std::string_view::npos;
    };
    std::sort(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
        return rank(a) != rank(b) ? rank(a) < rank(b) : a < b;
    });
}

std::vector<std::string> channelNames(const Imf::ChannelList& list, const fs::path& path) {
    std::vector<std::string> names;
    for (auto channel = list.begin(); channel != list.end(); ++channel) {
        if (channel.channel().xSampling != 1 || channel.channel().ySampling != 1)
            throw cannotRead(path,
                             fmt::format("its channel '{}' is subsampled; convert it to RGB first", channel.name()));
        names.emplace_back(channel.name());
    }
    if (names.empty()) throw cannotRead(path, "it has no channels");
    sortChannels(names);
    return names;
}

Image readExrPixels(const fs::path& path, const Monitor& monitor) {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const std::vector<std::string> names = channelNames(file.header().channels(), path);
    const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;

    Image image = filledImage(width, height, names);
    Imf::FrameBuffer buffer;
    for (size_t i = 0; i < names.size(); ++i)
        buffer.insert(names[i], sliceOf(image.pixels.data() + i, window, names.size()));
    file.setFrameBuffer(buffer);
    constexpr int lines = 256; // the maximum in a chunk
    for (int y = window.min.y; y <= window.max.y; y += lines) {
        monitor.check();
        file.readPixels(y, std::min(window.max.y, y + lines - 1));
        if (monitor.report) monitor.report(std::min(1.0, double(y + lines - window.min.y) / height));
    }
    return withColors(std::move(image), displayFromLinear, monitor);
}

} // namespace

void writePng(const fs::path& path, const Image& image, const ColorScale& scale,
              const std::function<bool()>& cancelled) {
    checkImage(image);
    const auto width = static_cast<png_uint_32>(image.width), height = static_cast<png_uint_32>(image.height);
    if (rgbBytes(width, height) > kMaxPngBytes)
        throw ValueError(
            fmt::format("an image of {} x {} pixels is too large for a PNG; write an .exr", width, height));
    constexpr double kColors = 3 * sizeof(float), kBytes = 3, kCompressed = 3; // per pixel
    requireMemory((kBytes + (isRgb(image) ? kCompressed : kColors)) * width * height,
                  fmt::format("'{}'", path.string()), "choose a smaller width");
    const std::vector<png_byte> bytes = displayBytes(image, scale, {.report = {}, .cancelled = cancelled});

    PngImage png;
    png.width = width;
    png.height = height;
    png.format = PNG_FORMAT_RGB;
    PngStream stream{.cancelled = cancelled};
    const bool encoded = [&] {
        const PngStream::File file = stream.file("wb");
        return png_image_write_to_stdio(&png, file.get(), 0, bytes.data(), 0, nullptr) != 0;
    }();
    if (stream.stopped()) throw Interrupted();
    if (!encoded) throw cannotWrite(path, png.message);
    writeAtomically(
        path, [&](std::ostream& out) { out.write(stream.written.data(), std::streamsize(stream.written.size())); },
        cancelled);
}

Image readPng(const fs::path& path, const Monitor& monitor) {
    const std::string bytes = readBytes(path);
    PngStream stream{.left = bytes, .cancelled = monitor.cancelled};
    const PngStream::File file = stream.file("rb");
    PngImage png;
    const auto failed = [&]() -> FileError {
        monitor.check();
        return cannotRead(path, png.message);
    };
    if (!png_image_begin_read_from_stdio(&png, file.get())) throw failed();
    const uintmax_t size = rgbBytes(png.width, png.height);
    if (size > kMaxPngBytes)
        throw cannotRead(path, fmt::format("a PNG of {} x {} pixels is too large to read", png.width, png.height));
    validatePng(bytes, path);
    // libpng stops after the last row, so it would not notice a missing end.
    constexpr std::string_view end("\0\0\0\0IEND\xae\x42\x60\x82", 12);
    if (bytes.find(end) == std::string::npos) throw cannotRead(path, "it is cut off: its end is missing");

    png.format = PNG_FORMAT_RGB;
    std::vector<png_byte> decoded(size);
    if (!png_image_finish_read(&png, nullptr, decoded.data(), 0, nullptr)) throw failed();
    Image image = filledImage(static_cast<int>(png.width), static_cast<int>(png.height), {"R", "G", "B"});
    std::transform(decoded.begin(), decoded.end(), image.pixels.begin(),
                   [](png_byte byte) { return static_cast<float>(byte) / 255; });
    return image;
}

void writeExr(const fs::path& path, const Image& image, const ExrOptions& options,
              const std::function<bool()>& cancelled) {
    checkImage(image);
    requireMemory(static_cast<double>(image.pixels.size() * (sizeof(float) + (options.half ? sizeof(half) : 0))),
                  fmt::format("'{}'", path.string()), "choose a smaller width");
    const Monitor monitor{.report = {}, .cancelled = cancelled};
    const Image linear = withColors(image, linearFromDisplay, monitor);
    const std::vector<half> rounded = options.half ? halves(linear.pixels, monitor) : std::vector<half>{};
    writeAtomically(path, [&](std::ostream& stream) {
        try {
            Imf::Header header(image.width, image.height);
            header.compression() = Imf::ZIP_COMPRESSION;
            header.insert("software", Imf::StringAttribute("Curlew"));
            if (rgbChannels(image)) Imf::addChromaticities(header, Imf::Chromaticities()); // sRGB's
            Imf::FrameBuffer buffer;
            const Imath::Box2i window = header.dataWindow();
            const size_t count = image.channels.size();
            for (size_t i = 0; i < count; ++i) {
                const bool half = storedAsHalf(image.channels[i], options);
                header.channels().insert(image.channels[i], Imf::Channel(half ? Imf::HALF : Imf::FLOAT));
                buffer.insert(image.channels[i], half ? sliceOf(rounded.data() + i, window, count)
                                                      : sliceOf(linear.pixels.data() + i, window, count));
            }
            ExrStream sink(stream, path);
            Imf::OutputFile file(sink, header);
            file.setFrameBuffer(buffer);
            constexpr int kLines = 16; // of a chunk with ZIP_COMPRESSION
            for (int line = 0; line < image.height; line += kLines) {
                monitor.check();
                file.writePixels(std::min(kLines, image.height - line));
            }
        } catch (const Iex::BaseExc& exception) {
            throw cannotWrite(path, reasonOf(exception));
        }
        // OutputFile writes its table of offsets in its destructor, which cannot report a failure.
        if (!stream.flush()) throw std::ios_base::failure("offsets");
    });
}

Image readExr(const fs::path& path, const Monitor& monitor) {
    std::ifstream stream = opened(path);
    if (!Imf::isOpenExrFile(path.c_str())) throw cannotRead(path, "it is not an OpenEXR file");
    validateExr(stream, path);
    try {
        return readExrPixels(path, monitor);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& exception) {
        throw cannotRead(path, reasonOf(exception));
    }
}

} // namespace curlew
