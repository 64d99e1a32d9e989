// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <functional>
#include <string>
#include <string_view>

namespace curlew::app {

enum class Verbosity { quiet, normal, verbose };

/// How far a computation has come.
struct Progress {
    const std::string& title;
    double fraction; ///< 0 … 1
    double seconds;  ///< since it began
};

/// Who hears what a program says. Functions that are empty do not hear; none may throw.
struct Listener {
    std::function<void(std::string_view line)> say = {};         ///< Results, advice and warnings.
    std::function<void(std::string_view text)> print = {};       ///< What -print, -help and the like are there for.
    std::function<void(const Progress& progress)> progress = {}; ///< From any thread, one at a time.
    std::function<bool()> cancelled = {};                        ///< Whether to stop. From any thread.
};

/// Prints on the standard output, and says on the standard error stream; there is progress too for what takes over a
/// second — a bar on a terminal, a plain line every few seconds otherwise.
Listener terminal(std::function<bool()> cancelled);

/// Where a program speaks: passes on to its listener what its user wants to hear.
class Console {
  public:
    explicit Console(Listener listener) : mListener(std::move(listener)) {}
    /// On the terminal.
    explicit Console(std::function<bool()> cancelled) : Console(terminal(std::move(cancelled))) {}

    void setVerbosity(Verbosity verbosity) { mVerbosity = verbosity; }
    /// What is printed goes where lines are said: the standard output belongs to a file.
    void printAsSaid();
    bool cancelled() const { return mListener.cancelled && mListener.cancelled(); }
    const std::function<bool()>& cancelFunction() const { return mListener.cancelled; }

    /// Text that the program was asked for; also when quiet.
    void print(std::string_view text) const;
    /// A line of result or advice; not when quiet.
    void say(std::string_view line) const;
    /// A line that only -verbose shows.
    void detail(std::string_view line) const;
    /// A line that the user should not miss; not when quiet.
    void warn(std::string_view line) const { say("warning: " + std::string(line)); }

    /// Follows one computation under the given title; silently when quiet.
    Monitor follow(std::string title) const;

  private:
    Listener mListener;
    Verbosity mVerbosity = Verbosity::normal;
};

} // namespace curlew::app
