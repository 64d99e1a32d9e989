#pragma once

#include "curlew/base/Monitor.h"

#include <chrono>
#include <string>
#include <string_view>

namespace curlew::app {

enum class Verbosity { quiet, normal, verbose };

/// What the user sees while the command works, all on the standard error stream: one line per action, and for what
/// takes over a second its progress — a bar on a terminal, a plain line every few seconds otherwise.
class Console {
  public:
    explicit Console(std::function<bool()> cancelled) : mCancelled(std::move(cancelled)) {}

    void setVerbosity(Verbosity verbosity) { mVerbosity = verbosity; }
    bool cancelled() const { return mCancelled && mCancelled(); }
    const std::function<bool()>& cancelFunction() const { return mCancelled; }

    /// A line of result or advice; not when quiet.
    void say(std::string_view line);
    /// A line that only -verbose shows.
    void detail(std::string_view line);
    /// A line that the user should not miss; not when quiet.
    void warn(std::string_view line) { say("warning: " + std::string(line)); }

    /// Follows one computation under the given title. The Console must outlive the monitor.
    Monitor follow(std::string title);

  private:
    void show(const std::string& title, double fraction, std::chrono::steady_clock::time_point started);
    void clearBar();

    std::function<bool()> mCancelled;
    Verbosity mVerbosity = Verbosity::normal;
    bool mBarShown = false;
    std::chrono::steady_clock::time_point mLastShown{};
};

} // namespace curlew::app
