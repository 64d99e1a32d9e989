// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <functional>
#include <string>
#include <string_view>

namespace curlew::app {

enum class Verbosity { quiet, normal, verbose };

/// The progress of a computation.
struct Progress {
    const std::string& title;
    double fraction; ///< 0 … 1
    double seconds;  ///< since it began
};

/// Receives a program's output. Empty functions are not called; none may throw.
struct Listener {
    std::function<void(std::string_view line)> info = {};        ///< Results, advice and warnings.
    std::function<void(std::string_view text)> print = {};       ///< The output of -print, -help and similar actions.
    std::function<void(const Progress& progress)> progress = {}; ///< Called from any thread, one call at a time.
    std::function<bool()> cancelled = {};                        ///< Returns whether to stop. Called from any thread.
};

/// Returns a listener that prints to the standard output and writes messages to the standard error stream. It also
/// shows the progress of computations that take more than a second: as a bar on a terminal, otherwise as a line every
/// few seconds.
Listener terminal(std::function<bool()> cancelled);

/// Passes a program's output on to its listener, filtered by the verbosity.
class Console {
  public:
    explicit Console(Listener listener) : mListener(std::move(listener)) {}
    /// A console on the terminal.
    explicit Console(std::function<bool()> cancelled) : Console(terminal(std::move(cancelled))) {}

    void setVerbosity(Verbosity verbosity) { mVerbosity = verbosity; }
    /// Sends printed text where messages go, because a file is written to the standard output.
    void printAsMessages();
    bool cancelled() const { return mListener.cancelled && mListener.cancelled(); }
    const std::function<bool()>& cancelFunction() const { return mListener.cancelled; }

    /// Prints requested text, even if quiet.
    void print(std::string_view text) const;
    /// Sends a message (a line of results or advice), unless quiet.
    void info(std::string_view line) const;
    /// Sends a message that only -verbose shows.
    void detail(std::string_view line) const;
    /// Sends a warning, unless quiet.
    void warn(std::string_view line) const { info("warning: " + std::string(line)); }

    /// Returns a monitor for one computation with this title. It reports no progress if quiet.
    Monitor follow(std::string title) const;

  private:
    Listener mListener;
    Verbosity mVerbosity = Verbosity::normal;
};

} // namespace curlew::app
