// SPDX-License-Identifier: Apache-2.0
// Pictures whose headers claim more data than the file has.

#include "curlew/base/Error.h"
#include "curlew/picture/ImageFile.h"
#include "support/Catch.h"
#include "support/Files.h"

#include <atomic>
#include <filesystem>
#include <random>
#include <string>

using namespace curlew;
namespace fs = std::filesystem;
using test::bytesOf;
using test::store;
using Folder = test::ScratchFolder;

namespace {

/// An EXR header of one part: the given attributes, followed by the required ones.
struct ExrBytes {
    std::string bytes = std::string("\x76\x2f\x31\x01\x02\0\0\0", 8);

    static std::string number(int32_t value) { return {reinterpret_cast<const char*>(&value), sizeof value}; }
    ExrBytes& add(const std::string& name, const std::string& type, const std::string& value) {
        bytes += name + '\0' + type + '\0' + number(static_cast<int32_t>(value.size())) + value;
        return *this;
    }
    ExrBytes& image(int width, int height, char compression) {
        const std::string window = number(0) + number(0) + number(width - 1) + number(height - 1);
        add("channels", "chlist",
            std::string("Y\0", 2) + number(2) + std::string(4, '\0') + number(1) + number(1) + '\0');
        add("compression", "compression", std::string(1, compression));
        add("dataWindow", "box2i", window).add("displayWindow", "box2i", window);
        add("lineOrder", "lineOrder", std::string(1, '\0'));
        add("pixelAspectRatio", "float", number(0x3f800000));
        add("screenWindowCenter", "v2f", number(0) + number(0)).add("screenWindowWidth", "float", number(0x3f800000));
        return *this;
    }
    std::string whole() const { return bytes + '\0' + std::string(400, '\0'); }
};

/// Returns the error message for a file that cannot be read.
std::string complaint(const fs::path& path) {
    try {
        readExr(path);
    } catch (const FileError& error) {
        return error.what();
    }
    return "it was read";
}

} // namespace

TEST_CASE("EXR: header attributes that claim more bytes than present are refused", "[picture]") {
    const Folder folder;
    const auto said = [&](const ExrBytes& exr) {
        store(folder / "a.exr", exr.whole());
        return complaint(folder / "a.exr");
    };
    const auto number = ExrBytes::number;
    const std::string huge = number(23170) + number(23170);
    CHECK_THAT(said(ExrBytes().add("preview", "preview", huge + "abcd").image(8, 8, 3)),
               Catch::ContainsSubstring("header"));
    CHECK_THAT(said(ExrBytes().add("names", "stringvector", number(1 << 30) + "abcd").image(8, 8, 3)),
               Catch::ContainsSubstring("header"));
    CHECK_THAT(said(ExrBytes().add("size", "v3d", "short").image(8, 8, 3)), Catch::ContainsSubstring("header"));
    ExrBytes longer;
    longer.add("text", "string", "hello").image(8, 8, 3);
    longer.bytes.replace(longer.bytes.find("hello") - 4, 4, number(0x7fffff00));
    CHECK_THAT(said(longer), Catch::ContainsSubstring("header"));
    // The largest number of pixels that each compression can hold, and a table of chunks that is longer than the file.
    CHECK_THAT(said(ExrBytes().image(800000, 1, 3)), Catch::ContainsSubstring("claims"));
    CHECK_THAT(said(ExrBytes().image(40000, 1, 1)), Catch::ContainsSubstring("claims"));
    CHECK_THAT(said(ExrBytes().image(1, 1 << 24, 3)), Catch::ContainsSubstring("claims"));
}

TEST_CASE("OpenEXR: writing asks for every 16 lines whether it is cancelled", "[picture]") {
    const Folder folder;
    const fs::path path = folder / "a.exr";
    const Image image = filledImage(20, 400, {"R", "G", "B"}, 0.5f);
    const ExrOptions options{.half = GENERATE(false, true)};
    writeExr(path, image, options);
    const std::string earlier = bytesOf(path);
    std::atomic<size_t> all = 0;
    writeExr(path, image, options, [&] { return ++all == 0; });
    CHECK(all >= 400 / 16);
    for (const size_t last : {size_t{1}, all / 2, all.load()}) {
        std::atomic<size_t> asked = 0;
        CHECK_THROWS_AS(writeExr(path, image, options, [&] { return ++asked == last; }), Interrupted);
        CHECK((bytesOf(path) == earlier));
        CHECK(folder.files() == 1);
    }
}

TEST_CASE("PNG: reading and writing can be cancelled and an impossible height is refused", "[picture]") {
    const Folder folder;
    const fs::path path = folder / "a.png";
    writePng(path, filledImage(1500, 1000, {"R", "G", "B"}));
    CHECK(fs::file_size(path) < 1500 * 1000 * 3 / 100);
    Image busy = filledImage(400, 300, {"R", "G", "B"}); // large enough for many reads
    std::minstd_rand random(1);
    for (float& value : busy.pixels) value = static_cast<float>(random() % 256) / 255;
    writePng(folder / "busy.png", busy);
    int asked = 0;
    CHECK_THROWS_AS(readPng(folder / "busy.png", {.report = {}, .cancelled = [&] { return ++asked > 1; }}),
                    Interrupted);
    CHECK_THROWS_AS(writePng(path, filledImage(1500, 1000, {"R", "G", "B"}), {}, [] { return true; }), Interrupted);
    CHECK(readPng(path).width == 1500);
    // The same file with a height of 2 billion claims more than deflate can compress. The CRC of the header is checked
    // later.
    std::string bytes = bytesOf(path);
    bytes[20] = 0x77;
    store(path, bytes);
    CHECK_THROWS_AS(readPng(path), FileError);
}
