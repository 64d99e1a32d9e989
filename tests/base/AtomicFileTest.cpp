// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"
#include "support/Catch.h"
#include "support/Variable.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <locale>
#include <sstream>
#include <thread>

using namespace curlew;
namespace fs = std::filesystem;

namespace {

/// An empty folder that is deleted at the end of the test.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("curlew-test-" + std::to_string(::getpid()));
    Folder() {
        fs::remove_all(path);
        fs::create_directory(path);
    }
    ~Folder() { fs::remove_all(path); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    ptrdiff_t entries() const { return std::distance(fs::directory_iterator(path), fs::directory_iterator()); }
};

std::string contents(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

const std::function<void(std::ostream&)> kWriteNew = [](std::ostream& out) { out << "new"; };

/// While it exists, no file can exceed this size, as on a full disk.
struct FileSizeLimit {
    rlimit before{};
    void (*handler)(int);
    explicit FileSizeLimit(rlim_t bytes) : handler(std::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &before);
        const rlimit now{bytes, before.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &now);
    }
    ~FileSizeLimit() {
        ::setrlimit(RLIMIT_FSIZE, &before);
        std::signal(SIGXFSZ, handler);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;
};

} // namespace

TEST_CASE("writeAtomically: the whole file is written and no temporary file remains", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.bin";
    const std::string bytes("\0\r\n\xff binary", 11);
    writeAtomically(file, [&](std::ostream& out) { out << bytes; });
    CHECK(contents(file) == bytes);
    writeAtomically(file, kWriteNew); // replaces the file
    CHECK(contents(file) == "new");
    writeAtomically(file, [&](std::ostream&) {}); // an empty file is valid
    CHECK(contents(file).empty());
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: the writer receives a temporary file name in the same folder", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.vdb";
    fs::path name;
    writeAtomically(file, [&](const fs::path& temporary) {
        name = temporary;
        CHECK_FALSE(fs::exists(file));
        std::ofstream(temporary) << "named";
    });
    CHECK(name.parent_path() == folder.path);
    CHECK(name != file);
    CHECK(contents(file) == "named");
    CHECK(folder.entries() == 1);
    // A writer that writes nothing has not created the file.
    CHECK_THROWS_AS(writeAtomically(folder.path / "b", [](const fs::path&) {}), FileError);
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: a failed write keeps the earlier file and removes the temporary one", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.txt";
    const bool existed = GENERATE(false, true);
    if (existed) std::ofstream(file) << "old";
    struct Odd {};
    CHECK_THROWS_AS(writeAtomically(file,
                                    [](std::ostream& out) {
                                        out << "half of ";
                                        throw Odd{};
                                    }),
                    Odd);
    CHECK_THROWS_AS(writeAtomically(file,
                                    [](const fs::path& temporary) {
                                        std::ofstream(temporary) << "half of ";
                                        throw Odd{};
                                    }),
                    Odd);
    CHECK(fs::exists(file) == existed);
    if (existed) CHECK(contents(file) == "old");
    CHECK(folder.entries() == existed);
}

TEST_CASE("writeAtomically: a cancelled write throws Interrupted and keeps the earlier file", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.txt";
    std::ofstream(file) << "old";
    int asked = 0, written = 0;
    const auto writeMuch = [&](std::ostream& out) {
        for (; written < 1000; ++written) out << "some text\n";
    };
    CHECK_THROWS_AS(writeAtomically(file, writeMuch, [&] { return ++asked == 3; }), Interrupted);
    CHECK(written < 1000);
    CHECK(contents(file) == "old");
    CHECK(folder.entries() == 1);
    CHECK_NOTHROW(writeAtomically(file, kWriteNew, [] { return false; }));
    CHECK(contents(file) == "new");
}

TEST_CASE("writeAtomically: a full disk throws a FileError that names the file", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.txt";
    std::ofstream(file) << "old";
    std::string message;
    // One size exceeds any buffer; the other is small enough to be noticed only when the file is flushed at the end.
    const size_t bytes = GENERATE(size_t{1} << 20, size_t{600});
    try {
        const FileSizeLimit limit(500);
        writeAtomically(file, [&](std::ostream& out) { out << std::string(bytes, 'x'); });
    } catch (const FileError& error) {
        message = error.what();
    }
    CAPTURE(bytes, message);
    CHECK(message.find(file.string()) != std::string::npos);
    CHECK(message.find("File too large") != std::string::npos); // the system's message for this limit
    CHECK(contents(file) == "old");
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: an unwritable target is refused by name before the writer runs", "[base]") {
    const Folder folder;
    fs::create_directory(folder.path / "sub");
    const std::array<fs::path, 4> targets{folder.path / "missing" / "a.txt", // no such folder
                                          folder.path / "sub",               // a folder
                                          folder.path / "sub" / "",          // no file name
                                          fs::path()};                       // empty path
    const fs::path& target = targets[GENERATE(size_t{0}, size_t{1}, size_t{2}, size_t{3})];
    CAPTURE(target);
    bool called = false;
    try {
        writeAtomically(target, [&](std::ostream&) { called = true; });
        FAIL("no exception");
    } catch (const FileError& error) {
        CHECK_THAT(error.what(), Catch::ContainsSubstring("'" + target.string() + "'"));
    }
    CHECK_FALSE(called);
    CHECK_THROWS_AS(checkWritable(target), FileError);
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: creates the last missing folder of a relative path but no parents of it", "[base]") {
    const Folder folder;
    struct InFolder {
        fs::path before = fs::current_path();
        explicit InFolder(const fs::path& path) { fs::current_path(path); }
        ~InFolder() { fs::current_path(before); }
    } const inFolder(folder.path);
    CHECK_NOTHROW(checkWritable("out/a.txt"));
    CHECK(folder.entries() == 0);
    CHECK_THROWS_AS(writeAtomically("out/a.txt", [](std::ostream&) { throw Interrupted(); }), Interrupted);
    CHECK(folder.entries() == 0); // a failed write leaves no folder behind
    writeAtomically("out/a.txt", kWriteNew);
    writeAtomically("out/more/b.txt", kWriteNew);
    CHECK(contents("out/a.txt") == "new");
    CHECK(contents("out/more/b.txt") == "new");
    CHECK_THROWS_WITH(checkWritable("none/more/a.txt"), Catch::ContainsSubstring("there is no folder 'none'"));
    CHECK_THROWS_AS(writeAtomically("none/more/a.txt", kWriteNew), FileError);
    CHECK_THROWS_AS(checkWritable("out/a.txt/b.txt"), FileError); // a file has the name of the folder
    CHECK_THROWS_AS(checkWritable(folder.path / "none" / "a.txt"), FileError);
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: keeps the permissions of a replaced file and applies the umask to a new one", "[base]") {
    const Folder folder;
    const fs::path secret = folder.path / "secret", plain = folder.path / "plain";
    std::ofstream(secret) << "old";
    fs::permissions(secret, fs::perms::owner_read | fs::perms::owner_write);
    const mode_t before = ::umask(027);
    writeAtomically(secret, [&](const fs::path& temporary) {
        CHECK((fs::status(temporary).permissions() & fs::perms::group_all) == fs::perms::none); // not even temporarily
        std::ofstream(temporary) << "new";
    });
    writeAtomically(plain, kWriteNew);
    ::umask(before);
    CHECK(fs::status(secret).permissions() == (fs::perms::owner_read | fs::perms::owner_write));
    CHECK(fs::status(plain).permissions() == static_cast<fs::perms>(0640));
    CHECK(contents(secret) == "new");
}

TEST_CASE("writeAtomically: replaces a read-only file, which stays read-only", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.txt";
    std::ofstream(file) << "old";
    fs::permissions(file, fs::perms::owner_read | fs::perms::group_read);
    writeAtomically(file, [&](const fs::path& temporary) {
        // Root may write to any file, others need this permission.
        CHECK((fs::status(temporary).permissions() & fs::perms::owner_write) != fs::perms::none);
        std::ofstream(temporary) << "new";
    });
    CHECK(contents(file) == "new");
    CHECK(fs::status(file).permissions() == (fs::perms::owner_read | fs::perms::group_read));
}

TEST_CASE("writeAtomically: a pipe needs a temporary folder, and FileError says so", "[base]") {
    const test::Variable folder("TMPDIR", "/nonexistent");
    CHECK_THROWS_WITH(writeAtomically("/dev/null", kWriteNew), Catch::ContainsSubstring("TMPDIR"));
    CHECK_THROWS_AS(writeAtomically("/dev/null", kWriteNew), FileError);
}

TEST_CASE("writeAtomically: follows symbolic links and replaces their target", "[base]") {
    const Folder folder;
    fs::create_directory(folder.path / "there");
    const fs::path target = folder.path / "there" / "target", link = folder.path / "link", loop = folder.path / "loop";
    const bool dangling = GENERATE(false, true);
    if (!dangling) std::ofstream(target) << "old";
    fs::create_symlink("there/target", folder.path / "second");
    fs::create_symlink(folder.path / "second", link);
    CHECK_NOTHROW(checkWritable(link));
    writeAtomically(link, kWriteNew);
    CHECK(fs::is_symlink(link));
    CHECK(contents(target) == "new");
    fs::create_symlink(loop, loop);
    CHECK_THROWS_WITH(writeAtomically(loop, kWriteNew), Catch::ContainsSubstring("form a loop"));
    CHECK_THROWS_AS(checkWritable(loop), FileError);
}

TEST_CASE("writeAtomically: writes into pipes and devices without replacing them", "[base]") {
    const Folder folder;
    const fs::path pipe = folder.path / "pipe";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    CHECK_NOTHROW(checkWritable(pipe));
    std::string text;
    std::thread reader([&] { text = contents(pipe); });
    const std::string much(300000, 'x');
    writeAtomically(pipe, [&](std::ostream& out) { out << much; });
    reader.join();
    CHECK(text == much);
    CHECK(fs::is_fifo(pipe));
    CHECK(folder.entries() == 1);
    writeAtomically("/dev/null", kWriteNew);
    CHECK(fs::is_character_file("/dev/null"));
    CHECK_THROWS_AS(writeAtomically("/dev/full", kWriteNew), FileError);
}

TEST_CASE("writeAtomically: writes to an open file descriptor at its current offset", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a";
    const int open = ::open(file.c_str(), O_RDWR | O_CREAT, 0600);
    REQUIRE(open >= 0);
    REQUIRE(::write(open, "before ", 7) == 7);
    writeAtomically("/dev/fd/" + std::to_string(open), kWriteNew);
    REQUIRE(::write(open, " after", 6) == 6);
    ::close(open);
    CHECK(contents(file) == "before new after");
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: accepts file names of the maximum length of 255 bytes", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / std::string(255, 'n');
    writeAtomically(file, kWriteNew);
    CHECK(contents(file) == "new");
    CHECK_THROWS_AS(writeAtomically(folder.path / std::string(256, 'n'), kWriteNew), FileError);
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: removes stale temporary files but not locked ones", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.vdb";
    std::array<fs::path, 3> left;
    for (fs::path& name : left)
        writeAtomically(file, [&](const fs::path& temporary) {
            name = temporary;
            std::ofstream(temporary) << "x";
        });
    for (const fs::path& name : left) std::ofstream(name) << "half";
    const int lock = ::open(left[1].c_str(), O_RDONLY);
    REQUIRE(::flock(lock, LOCK_EX | LOCK_NB) == 0);
    const fs::path other = folder.path / ".curlew-of-the-user.part";
    std::ofstream(other) << "mine";
    writeAtomically(file, kWriteNew);
    CHECK_FALSE(fs::exists(left[0]));
    CHECK(fs::exists(left[1])); // locked
    CHECK_FALSE(fs::exists(left[2]));
    CHECK(fs::exists(other));
    ::close(lock);
}

TEST_CASE("removeUnfinishedFiles: removes what is being written, and nothing else", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.vdb", other = folder.path / "b.vdb";
    writeAtomically(other, kWriteNew);
    CHECK_THROWS_AS(writeAtomically(file,
                                    [](const fs::path& temporary) {
                                        std::ofstream(temporary) << "half";
                                        removeUnfinishedFiles();
                                        CHECK_FALSE(fs::exists(temporary));
                                    }),
                    FileError);
    removeUnfinishedFiles();
    CHECK(contents(other) == "new");
    CHECK(folder.entries() == 1);
}

TEST_CASE("writeAtomically: number formatting ignores the global locale", "[base]") {
    struct Grouped : std::numpunct<char> {
        char do_thousands_sep() const override { return '.'; }
        char do_decimal_point() const override { return ','; }
        std::string do_grouping() const override { return "\3"; }
    };
    const Folder folder;
    const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Grouped));
    std::ostringstream grouped;
    grouped << 12345;
    writeAtomically(folder.path / "a", [](std::ostream& out) { out << 12345 << ' ' << 0.5; });
    std::locale::global(before);
    CHECK(grouped.str() == "12.345"); // the locale is in force
    CHECK(contents(folder.path / "a") == "12345 0.5");
}

TEST_CASE("writeAtomically: a folder without write permission throws FileError", "[base]") {
    if (::geteuid() == 0) {
        WARN("skipped: root may write anywhere");
        return;
    }
    const Folder folder;
    fs::permissions(folder.path, fs::perms::owner_read | fs::perms::owner_exec);
    CHECK_THROWS_AS(writeAtomically(folder.path / "a.txt", kWriteNew), FileError);
    fs::permissions(folder.path, fs::perms::owner_all);
}

TEST_CASE("checkWritable: accepts new and existing files and changes neither", "[base]") {
    const Folder folder;
    const fs::path file = folder.path / "a.txt";
    CHECK_NOTHROW(checkWritable(file));
    CHECK_FALSE(fs::exists(file));
    std::ofstream(file) << "old";
    CHECK_NOTHROW(checkWritable(file));
    CHECK(contents(file) == "old");
    CHECK_NOTHROW(checkWritable("in-the-current-folder.txt"));
}
