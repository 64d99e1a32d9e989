// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/picture/ImageFile.h"
#include "support/Catch.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <sys/resource.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>

using namespace curlew;

namespace {

namespace fs = std::filesystem;

constexpr float quietNaN = std::numeric_limits<float>::quiet_NaN();

/// An empty folder that is deleted with its contents.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("curlew-image-" + std::to_string(::getpid()));
    Folder() { fs::remove_all(path), fs::create_directory(path); }
    ~Folder() { fs::remove_all(path); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    size_t count() const {
        return static_cast<size_t>(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
    }
};

std::string bytesOf(const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

void writeBytes(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

Image randomImage(int width, int height, std::vector<std::string> channels, uint64_t seed) {
    Image image = filledImage(width, height, std::move(channels));
    for (size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(randomUniform(seed, i));
    return image;
}

bool sameBits(const std::vector<float>& a, const std::vector<float>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](float x, float y) { return std::bit_cast<uint32_t>(x) == std::bit_cast<uint32_t>(y); });
}

/// Returns the error message for a file, after checking that it is a single line with the file's name.
std::string complaint(const fs::path& path) {
    try {
        path.extension() == ".exr" ? readExr(path) : readPng(path);
    } catch (const FileError& error) {
        const std::string text = error.what();
        CHECK(text.find(path.string()) != text.npos);
        CHECK(text.find('\n') == text.npos);
        return text;
    }
    return "it was read";
}

void writeImage(const fs::path& path, const Image& image) {
    path.extension() == ".exr" ? writeExr(path, image) : writePng(path, image);
}

} // namespace

TEST_CASE("EXR: preserves every bit including NaN and infinities", "[picture]") {
    const Folder folder;
    Image image = randomImage(67, 45, {"speed"}, 1);
    const float specials[] = {quietNaN,
                              -quietNaN,
                              std::numeric_limits<float>::infinity(),
                              -0.0f,
                              1e-45f,
                              std::numeric_limits<float>::max(),
                              std::bit_cast<float>(0x7fc12345u)};
    std::copy(std::begin(specials), std::end(specials), image.pixels.begin() + 100);
    writeExr(folder.path / "a.exr", image);
    const Image back = readExr(folder.path / "a.exr");
    CHECK(back.width == 67);
    CHECK(back.height == 45);
    CHECK(back.channels == image.channels);
    CHECK(sameBits(back.pixels, image.pixels));
}

TEST_CASE("EXR: channels keep their names in a fixed order", "[picture]") {
    const Folder folder;
    const Image image = randomImage(9, 5, {"vorticity", "B", "A", "G", "R", "divergence"}, 2);
    writeExr(folder.path / "a.exr", image);
    const Image back = readExr(folder.path / "a.exr");
    REQUIRE(back.channels == std::vector<std::string>{"R", "G", "B", "A", "divergence", "vorticity"});
    const int from[] = {4, 3, 1, 2, 5, 0};
    for (int channel = 0; channel < 6; ++channel) {
        CAPTURE(channel);
        for (int y = 0; y < 5; ++y)
            for (int x = 0; x < 9; ++x) CHECK(back.at(x, y, channel) == Approx(image.at(x, y, from[channel])));
    }
}

TEST_CASE("EXR: colours are stored in linear light and other channels unchanged", "[picture]") {
    const Folder folder;
    const fs::path path = folder.path / "a.exr";
    Image image = filledImage(2, 1, {"R", "G", "B", "A", "Z"});
    image.pixels = {0.5f, 1, 4, 0.5f, 0.1f, quietNaN, -0.5f, 0, 1, std::numeric_limits<float>::infinity()};
    writeExr(path, image);
    std::array<float, 4> red{};
    float depth[2] = {};
    {
        Imf::InputFile file(path.c_str());
        Imf::FrameBuffer buffer;
        const Imath::Box2i window = file.header().dataWindow();
        buffer.insert("R", Imf::Slice::Make(Imf::FLOAT, red.data(), window));
        buffer.insert("B", Imf::Slice::Make(Imf::FLOAT, red.data() + 2, window));
        buffer.insert("Z", Imf::Slice::Make(Imf::FLOAT, depth, window));
        file.setFrameBuffer(buffer);
        file.readPixels(0);
        CHECK(file.header().find("software") != file.header().end());
    }
    CHECK(red[0] == Approx(0.2140411));
    CHECK(std::isnan(red[1]));
    CHECK(red[2] == Approx(std::pow((4 + 0.055) / 1.055, 2.4)));
    CHECK(depth[0] == 0.1f);
    CHECK(depth[1] == std::numeric_limits<float>::infinity());
    const Image back = readExr(path);
    REQUIRE(back.channels == image.channels);
    for (size_t i = 0; i < image.pixels.size(); ++i) {
        CAPTURE(i);
        if (std::isnan(image.pixels[i]))
            CHECK(std::isnan(back.pixels[i]));
        else
            CHECK(back.pixels[i] == Approx(image.pixels[i]));
    }
}

TEST_CASE("EXR: half precision is smaller with eleven bits except for depth", "[picture]") {
    const Folder folder;
    Image image = randomImage(40, 30, {"Z", "speed"}, 13);
    image.at(0, 0, 1) = 1e9f, image.at(1, 0, 1) = -std::numeric_limits<float>::infinity(), image.at(2, 0, 1) = quietNaN;
    writeExr(folder.path / "half.exr", image, {.half = true});
    writeExr(folder.path / "float.exr", image);
    CHECK(20 * fs::file_size(folder.path / "half.exr") < 17 * fs::file_size(folder.path / "float.exr"));
    const Image back = readExr(folder.path / "half.exr");
    REQUIRE(back.channels == std::vector<std::string>{"Z", "speed"});
    CHECK(back.at(0, 0, 1) == 65504);
    CHECK(back.at(1, 0, 1) == -std::numeric_limits<float>::infinity());
    CHECK(std::isnan(back.at(2, 0, 1)));
    bool sameDepth = true;
    float worst = 0;
    for (int y = 1; y < 30; ++y)
        for (int x = 0; x < 40; ++x) {
            sameDepth = sameDepth && back.at(x, y, 0) == image.at(x, y, 0);
            worst = std::max(worst, std::abs(back.at(x, y, 1) / image.at(x, y, 1) - 1));
        }
    CHECK(sameDepth);
    CHECK(worst > 0);
    CHECK(worst <= 0x1p-11f);
}

TEST_CASE("EXR: reads half-precision files with an offset data window", "[picture]") {
    const Folder folder;
    const fs::path path = folder.path / "half.exr";
    const Imath::Box2i window({-3, 10}, {0, 11});
    const std::vector<half> values{half(0.0f), half(0.5f), half(1.0f), half(1.5f),
                                   half(2.0f), half(2.5f), half(3.0f), half(quietNaN)};
    {
        Imf::Header header(Imath::Box2i({0, 0}, {99, 99}), window);
        header.channels().insert("Y", Imf::Channel(Imf::HALF));
        Imf::FrameBuffer buffer;
        buffer.insert("Y", Imf::Slice::Make(Imf::HALF, values.data(), window));
        Imf::OutputFile file(path.c_str(), header);
        file.setFrameBuffer(buffer);
        file.writePixels(2);
    }
    const Image image = readExr(path);
    REQUIRE((image.width == 4 && image.height == 2));
    CHECK(image.at(1, 0) == 0.5f);
    CHECK(image.at(2, 1) == 3.0f);
    CHECK(std::isnan(image.at(3, 1)));
}

TEST_CASE("PNG: colours are read back within half a byte step", "[picture]") {
    const Folder folder;
    const fs::path path = folder.path / "a.png";
    Image image = randomImage(31, 17, {"R", "G", "B"}, 3);
    image.at(0, 0, 0) = -5, image.at(0, 0, 1) = 5, image.at(1, 0, 2) = quietNaN;
    writePng(path, image);
    const Image back = readPng(path);
    REQUIRE((back.width == 31 && back.height == 17));
    REQUIRE(back.channels == image.channels);
    CHECK(back.at(0, 0, 0) == 0);
    CHECK(back.at(0, 0, 1) == 1);
    CHECK(back.at(1, 0, 2) == Approx(kNoValueColor[2]).margin(0.5 / 255 + 1e-6));
    for (int y = 1; y < 17; ++y)
        for (int x = 0; x < 31; ++x)
            for (int i = 0; i < 3; ++i) CHECK(back.at(x, y, i) == Approx(image.at(x, y, i)).margin(0.5 / 255 + 1e-6));
}

TEST_CASE("PNG: channels are selected by name", "[picture]") {
    const Folder folder;
    Image image = filledImage(1, 1, {"Z", "B", "G", "A", "R"});
    image.pixels = {quietNaN, 0.2f, 0.4f, 0.1f, 0.6f};
    writePng(folder.path / "a.png", image);
    CHECK(readPng(folder.path / "a.png").pixels == std::vector<float>{153 / 255.0f, 102 / 255.0f, 51 / 255.0f});
}

TEST_CASE("PNG: a single channel is coloured by the scale", "[picture]") {
    const Folder folder;
    const ColorScale scale{.map = ColorMap::diverging, .lower = -2, .upper = 2};
    Image image = randomImage(20, 10, {"s"}, 4);
    for (float& value : image.pixels) value = 6 * value - 3;
    image.at(4, 4) = quietNaN;
    writePng(folder.path / "a.png", image, scale);
    const Image back = readPng(folder.path / "a.png"), expected = colorize(image, scale);
    REQUIRE(back.pixels.size() == expected.pixels.size());
    for (size_t i = 0; i < expected.pixels.size(); ++i) {
        CAPTURE(i);
        CHECK(back.pixels[i] == Approx(expected.pixels[i]).margin(0.5 / 255 + 1e-6));
    }
}

TEST_CASE("image files: the same image gives the same bytes and replaces an earlier file", "[picture]") {
    const Folder folder;
    const auto extension = GENERATE(".exr", ".png");
    CAPTURE(extension);
    const fs::path first = folder.path / (std::string("first") + extension),
                   second = folder.path / (std::string("2") + extension);
    const Image image = randomImage(50, 40, {"R", "G", "B"}, 5);
    writeBytes(first, "something older");
    writeImage(first, image);
    writeImage(second, image);
    CHECK(bytesOf(first) == bytesOf(second));
    CHECK(bytesOf(first).size() > 1000);
    CHECK(folder.count() == 2);
}

TEST_CASE("image files: missing and empty and foreign files and folders are refused", "[picture]") {
    const Folder folder;
    const std::string extension = GENERATE(".exr", ".png"), other = extension == ".exr" ? ".png" : ".exr";
    CAPTURE(extension);
    const fs::path path = folder.path / ("a" + extension);
    CHECK_THAT(complaint(path), Catch::ContainsSubstring("No such file"));

    writeBytes(path, "");
    CHECK_THAT(complaint(path), Catch::ContainsSubstring("empty"));

    writeBytes(path, "these are not the bytes of a picture, however long one looks at them");
    CHECK_THAT(complaint(path), Catch::ContainsSubstring(extension == ".exr" ? "not an OpenEXR file" : "PNG"));

    writeImage(folder.path / ("b" + other), randomImage(8, 8, {"R", "G", "B"}, 6));
    fs::rename(folder.path / ("b" + other), path);
    CHECK_THROWS_AS(extension == ".exr" ? readExr(path) : readPng(path), FileError);

    fs::create_directory(folder.path / ("folder" + extension));
    CHECK_THAT(complaint(folder.path / ("folder" + extension)), Catch::ContainsSubstring("directory"));
}

TEST_CASE("image files: truncated files are refused at any length", "[picture]") {
    const Folder folder;
    const std::string extension = GENERATE(".exr", ".png");
    const fs::path path = folder.path / ("a" + extension);
    writeImage(path, randomImage(24, 40, {"R", "G", "B"}, 7));
    const std::string whole = bytesOf(path);
    REQUIRE(complaint(path) == "it was read");
    for (size_t size = 0; size < whole.size(); size += size + 40 < whole.size() && size > 400 ? 37 : 1) {
        CAPTURE(extension, size, whole.size());
        writeBytes(path, whole.substr(0, size));
        CHECK_THROWS_AS(extension == ".exr" ? readExr(path) : readPng(path), FileError);
    }
}

TEST_CASE("image files: corrupted files give an image or a FileError", "[picture]") {
    const Folder folder;
    const std::string extension = GENERATE(".exr", ".png");
    const fs::path path = folder.path / ("a" + extension);
    writeImage(path, randomImage(13, 18, {"R", "G", "B"}, 8));
    const std::string whole = bytesOf(path);
    int refused = 0;
    for (uint64_t i = 0; i < 500; ++i) {
        std::string damaged = whole;
        // Half of the damage is in the header, where it has the most effect.
        const size_t range = i % 2 ? whole.size() : std::min<size_t>(whole.size(), 330);
        const size_t place = static_cast<size_t>(randomUniform(9, i) * static_cast<double>(range));
        damaged[place] = static_cast<char>(randomBits(10, i));
        CAPTURE(extension, i, place);
        writeBytes(path, damaged);
        try {
            checkImage(extension == ".exr" ? readExr(path) : readPng(path));
        } catch (const FileError&) {
            ++refused;
        }
    }
    CHECK(refused > 100);
}

TEST_CASE("EXR: a header that claims a huge picture is refused before allocation", "[picture]") {
    const Folder folder;
    const fs::path path = folder.path / "a.exr";
    writeExr(path, filledImage(16, 16, {"s"}));
    std::string bytes = bytesOf(path);
    // Changes the upper corners of dataWindow and displayWindow from 15 x 15 to 1 048 575 x 15.
    const std::string corner{15, 0, 0, 0, 15, 0, 0, 0};
    size_t corners = 0;
    for (size_t at = bytes.find(corner); at != bytes.npos; at = bytes.find(corner, at + 1), ++corners)
        bytes.replace(at, 4, std::string{'\xff', '\xff', '\x0f', '\0'});
    REQUIRE(corners == 2);
    writeBytes(path, bytes);
    CHECK_THAT(complaint(path), Catch::ContainsSubstring("claims"));
}

TEST_CASE("PNG: a header that claims a huge picture is refused before allocation", "[picture]") {
    const Folder folder;
    // The signature and the IHDR of 20 000 x 20 000 RGB with its CRC, followed by the header of an empty IDAT.
    const unsigned char head[] = {0x89, 'P',  'N',  'G',  13,   10,   26, 10, 0,    0,    0,   13,  'I', 'H',
                                  'D',  'R',  0,    0,    0x4e, 0x20, 0,  0,  0x4e, 0x20, 8,   2,   0,   0,
                                  0,    0x6c, 0x12, 0xd1, 0x6e, 0,    0,  0,  0,    'I',  'D', 'A', 'T'};
    writeBytes(folder.path / "a.png", std::string(std::begin(head), std::end(head)));
    CHECK_THAT(complaint(folder.path / "a.png"), Catch::ContainsSubstring("claims"));
}

TEST_CASE("image files: invalid images and targets are refused and leave no file", "[picture]") {
    const Folder folder;
    const std::string extension = GENERATE(".exr", ".png");
    CAPTURE(extension);
    const Image image = randomImage(4, 4, {"R", "G", "B"}, 11);
    CHECK_THROWS_AS(writeImage(folder.path / "missing" / ("a" + extension), image), FileError);
    CHECK_THROWS_AS(writeImage("/proc/curlew" + extension, image), FileError);

    const fs::path path = folder.path / ("a" + extension);
    CHECK_THROWS_AS(writeImage(path, Image{}), ValueError);
    Image torn = image;
    torn.pixels.pop_back();
    CHECK_THROWS_AS(writeImage(path, torn), ValueError);
    CHECK(folder.count() == 0);
}

TEST_CASE("PNG: channels that are not colours and scales without a range are refused", "[picture]") {
    const Folder folder;
    const fs::path path = folder.path / "a.png";
    CHECK_THROWS_WITH(writePng(path, filledImage(2, 2, {"X", "Y", "Z"})), Catch::ContainsSubstring("X, Y, Z"));
    CHECK_THROWS_AS(writePng(path, filledImage(2, 2, {"R", "G"})), ValueError);
    CHECK_THROWS_AS(writePng(path, filledImage(2, 2, {"s"}), {.lower = 0, .upper = quietNaN}), ValueError);
    CHECK(folder.count() == 0);
}

TEST_CASE("image files: a full disk gives a FileError and keeps the earlier file", "[picture]") {
    const Folder folder;
    const std::string extension = GENERATE(".exr", ".png");
    // A destructor writes the offsets of the EXR last. Limits just below its size affect these or the last rows.
    const size_t missing = GENERATE(1u, 100u, 20000u);
    const fs::path path = folder.path / ("a" + extension), probe = folder.path / ("probe" + extension);
    const Image image = randomImage(100, 100, {"R", "G", "B"}, 12);
    writeImage(probe, image);
    const size_t size = fs::file_size(probe);
    CAPTURE(extension, size, missing);
    REQUIRE(size > missing);
    writeBytes(path, "earlier");

    // A limit on file sizes fails like a full disk.
    rlimit before{};
    REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limited{.rlim_cur = size - missing, .rlim_max = before.rlim_max};
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &limited) == 0);
    bool failed = false;
    try {
        writeImage(path, image);
    } catch (const FileError&) {
        failed = true;
    } catch (...) {
    }
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);

    CHECK(failed);
    CHECK(bytesOf(path) == "earlier");
    CHECK(folder.count() == 2);
}
