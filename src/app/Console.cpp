#include "curlew/app/Console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace curlew::app {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

bool onTerminal() {
    static const bool terminal = isatty(STDERR_FILENO) != 0;
    return terminal;
}

/// That nobody can hear is no reason to stop.
void put(const std::string& text) {
    std::fputs(text.c_str(), stderr);
    std::fflush(stderr);
}

} // namespace

void Console::clearBar() {
    if (mBarShown) put("\r\x1b[K");
    mBarShown = false;
}

void Console::say(std::string_view line) {
    if (mVerbosity == Verbosity::quiet) return;
    clearBar();
    put(fmt::format("{}\n", line));
}

void Console::detail(std::string_view line) {
    if (mVerbosity == Verbosity::verbose) say(line);
}

Monitor Console::follow(std::string title) {
    if (mVerbosity == Verbosity::quiet) return {.report = {}, .cancelled = mCancelled};
    return {.report = [this, title = std::move(title),
                       started = Clock::now()](double fraction) { show(title, fraction, started); },
            .cancelled = mCancelled};
}

void Console::show(const std::string& title, double fraction, Clock::time_point started) {
    const auto now = Clock::now();
    if (now - started < 1s || now - mLastShown < (onTerminal() ? 100ms : 5000ms)) {
        if (fraction >= 1) clearBar();
        return;
    }
    mLastShown = now;
    const double elapsed = std::chrono::duration<double>(now - started).count();
    const double left = fraction > 0 ? elapsed * (1 - fraction) / fraction : 0;
    if (!onTerminal()) {
        put(fmt::format("{}: {:.0f} %, about {:.0f} s left\n", title, 100 * fraction, left));
        return;
    }
    constexpr int kWidth = 32;
    const int filled = std::clamp(static_cast<int>(fraction * kWidth), 0, kWidth);
    put(fmt::format("\r\x1b[K{} [{}{}] {:3.0f} %  {:.0f} s left", title, std::string(static_cast<size_t>(filled), '#'),
                    std::string(static_cast<size_t>(kWidth - filled), '.'), 100 * fraction, left));
    mBarShown = true;
    if (fraction >= 1) clearBar();
}

} // namespace curlew::app
