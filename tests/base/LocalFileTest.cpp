// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/LocalFile.h"
#include "support/Files.h"
#include "support/Variable.h"

#include <sys/stat.h>
#include <zlib.h>

#include <thread>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using Folder = test::ScratchFolder;
namespace fs = std::filesystem;

namespace {

void storeGzip(const fs::path& path, const std::string& bytes) {
    const gzFile file = gzopen(path.c_str(), "wb");
    REQUIRE(file);
    REQUIRE(gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size())) == static_cast<int>(bytes.size()));
    REQUIRE(gzclose(file) == Z_OK);
}

std::string longText() {
    std::string text;
    for (int64_t n = 0; n < 300000; ++n) text += std::to_string(n * 7919) + "\n";
    return text;
}

} // namespace

TEST_CASE("LocalFile: a plain file is used directly", "[base]") {
    const Folder folder;
    const fs::path name = test::store(folder / "Cow.OBJ", "v 0 0 0\n");
    CHECK(endingOf(name) == ".obj");
    CHECK(LocalFile(name, ".obj").path() == name);
    CHECK(LocalFile(folder / "missing.obj", ".obj").path() == folder / "missing.obj");
    CHECK_FALSE(isStream(name));
    CHECK(isStream("-"));
}

TEST_CASE("LocalFile: gzip is decompressed into a temporary copy that is removed afterwards", "[base]") {
    const Folder folder;
    const std::string text = longText();
    storeGzip(folder / "cow.obj.gz", text);
    storeGzip(folder / "cow.obj", text); // the name does not matter
    CHECK(endingOf("cow.OBJ.gz") == ".obj");
    fs::path copied;
    for (const char* name : {"cow.obj.gz", "cow.obj"}) {
        const LocalFile local(folder / name);
        copied = local.path();
        CHECK(copied.filename() == "cow.obj");
        CHECK(test::bytesOf(copied) == text);
    }
    CHECK_FALSE(fs::exists(copied));
    CHECK_FALSE(fs::exists(copied.parent_path()));
    CHECK(LocalFile(folder / "cow.obj.gz", ".txt").path().extension() == ".txt");
}

TEST_CASE("LocalFile: truncated or damaged gzip is an error", "[base]") {
    const Folder folder;
    storeGzip(folder / "cow.obj.gz", longText());
    std::string bytes = test::bytesOf(folder / "cow.obj.gz");
    test::store(folder / "cut.obj.gz", bytes.substr(0, bytes.size() / 2));
    CHECK_THROWS_WITH(LocalFile(folder / "cut.obj.gz"),
                      ContainsSubstring("cut.obj.gz") && ContainsSubstring("cut short or damaged"));
    bytes[bytes.size() - 6] = static_cast<char>(bytes[bytes.size() - 6] + 1); // changes the checksum
    test::store(folder / "bad.obj.gz", bytes);
    CHECK_THROWS_AS(LocalFile(folder / "bad.obj.gz"), FileError);
    CHECK_THROWS_AS(LocalFile(folder / "cow.obj.gz", "", [] { return true; }), Interrupted);
}

TEST_CASE("LocalFile: a pipe is read to its end", "[base]") {
    const Folder folder;
    const fs::path pipe = folder / "pipe.ply";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    CHECK(isStream(pipe));
    const std::string text = longText();
    std::thread writer([&] { std::ofstream(pipe, std::ios::binary) << text; });
    const LocalFile local(pipe);
    writer.join();
    CHECK(local.path().filename() == "pipe.ply");
    CHECK(test::bytesOf(local.path()) == text);
}

TEST_CASE("TemporaryFolder: an invalid TMPDIR throws FileError", "[base]") {
    const test::Variable folder("TMPDIR", "/nonexistent");
    CHECK_THROWS_AS(TemporaryFolder(), FileError);
    CHECK_THROWS_WITH(TemporaryFolder(), ContainsSubstring("TMPDIR"));
}
