// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Console.h"

#include "curlew/base/Error.h"
#include "curlew/base/Text.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>

namespace curlew::app {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

bool onTerminal() {
    static const bool terminal = isatty(STDERR_FILENO) != 0;
    return terminal;
}

/// Ignores errors: a closed stream is no reason to stop.
void put(const std::string& text) {
    std::fputs(text.c_str(), stderr);
    std::fflush(stderr);
}

/// Throws FileError if the standard output does not accept all of the text. A closed pipe is not an error.
void print(std::string_view text) {
    errno = 0;
    const bool whole = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
    if (!whole && errno != EPIPE)
        throw FileError(fmt::format("cannot write to the standard output: {}", std::strerror(errno)));
}

/// The standard streams, and the progress bar that may occupy the last line.
class Terminal {
  public:
    void info(std::string_view line) {
        clearBar();
        put(fmt::format("{}\n", printable(line)));
    }
    void show(const Progress& progress);

  private:
    void clearBar() {
        if (mBarShown) put("\r\x1b[K");
        mBarShown = false;
    }

    bool mBarShown = false;
    Clock::time_point mLastShown{};
};

void Terminal::show(const Progress& progress) {
    const auto now = Clock::now();
    const double fraction = progress.fraction;
    if (progress.seconds < 1 || now - mLastShown < (onTerminal() ? 100ms : 5000ms)) {
        if (fraction >= 1) clearBar();
        return;
    }
    mLastShown = now;
    // The first percent says little about the others.
    const std::string left =
        fraction < 0.01 ? "" : fmt::format("{:.0f} s left", progress.seconds * (1 - fraction) / fraction);
    if (!onTerminal()) {
        put(fmt::format("{}: {:.0f} %{}{}\n", progress.title, 100 * fraction, left.empty() ? "" : ", about ", left));
        return;
    }
    constexpr int kWidth = 32;
    const int filled = std::clamp(static_cast<int>(fraction * kWidth), 0, kWidth);
    put(fmt::format("\r\x1b[K{} [{}{}] {:3.0f} %  {}", progress.title, std::string(static_cast<size_t>(filled), '#'),
                    std::string(static_cast<size_t>(kWidth - filled), '.'), 100 * fraction, left));
    mBarShown = true;
    if (fraction >= 1) clearBar();
}

} // namespace

Listener terminal(std::function<bool()> cancelled) {
    const auto terminal = std::make_shared<Terminal>();
    return {.info = [terminal](std::string_view line) { terminal->info(line); },
            .print = print,
            .progress = [terminal](const Progress& progress) { terminal->show(progress); },
            .cancelled = std::move(cancelled)};
}

void Console::printAsMessages() {
    mListener.print = [info = mListener.info](std::string_view text) {
        for (size_t begin = 0; info && begin < text.size();) {
            const size_t end = std::min(text.find('\n', begin), text.size());
            info(text.substr(begin, end - begin));
            begin = end + 1;
        }
    };
}

void Console::print(std::string_view text) const {
    if (mListener.print) mListener.print(text);
}

void Console::info(std::string_view line) const {
    if (mVerbosity != Verbosity::quiet && mListener.info) mListener.info(line);
}

void Console::detail(std::string_view line) const {
    if (mVerbosity == Verbosity::verbose) info(line);
}

Monitor Console::follow(std::string title) const {
    Monitor monitor{.report = {}, .cancelled = mListener.cancelled};
    if (mVerbosity != Verbosity::quiet && mListener.progress)
        monitor.report = [progress = mListener.progress, title = std::move(title),
                          began = Clock::now()](double fraction) {
            const double seconds = std::chrono::duration<double>(Clock::now() - began).count();
            progress({.title = title, .fraction = fraction, .seconds = seconds});
        };
    return monitor;
}

} // namespace curlew::app
