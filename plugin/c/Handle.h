// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Guard.h"

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

namespace curlew::c {

/// The functions of a program's caller, and whether one of them (or curlew_cancel) has asked it to stop.
class Caller {
  public:
    void begin(const curlew_callbacks* callbacks);
    void end();
    void cancel() { mCancelled = true; }

    /// What the program is heard with.
    app::Listener listener();
    void frame(int frame);

  private:
    void message(std::string_view text) const;
    void progress(const app::Progress& progress);
    bool cancelled();
    /// Calls the caller's progress function, if it is time to. With the lock held.
    void tell();

    curlew_callbacks mCallbacks{};
    std::atomic<bool> mCancelled = false;
    std::mutex mTelling;
    std::string mTitle;
    double mFraction = 0;
    std::chrono::steady_clock::time_point mTold{};
};

} // namespace curlew::c

/// A session of the interface.
struct curlew_session {
    /// While it lives, the program of the session runs. Throws ValueError where one runs already.
    class Running;
    /// The session, to look at: while it runs, only for its frame callback. Throws ValueError otherwise.
    const curlew::app::Session& readable() const;
    /// The session, to change. Throws ValueError while it runs.
    curlew::app::Session& writable();

    curlew::c::Caller caller;
    curlew::app::Console console{caller.listener()};
    curlew::app::Session session{console};
    mutable std::string text; ///< What it has told last.
    /// Results that curlew_find() has been asked for; their positions begin at kFound.
    mutable std::vector<curlew::app::Session::Held> found;
    mutable std::vector<const void*> leaves; ///< Of the grid that was last asked for its leaves.
    mutable openvdb::GridBase::ConstPtr leavesOf;
    static constexpr int64_t kFound = int64_t{1} << 32;

    /// The object of a kind at a position: its age among those of that kind, or what curlew_find() has told. Throws
    /// ValueError if there is none.
    const curlew::app::Session::Held& object(curlew_kind kind, int64_t position) const;
    size_t count(curlew_kind kind) const;

    std::atomic<bool> running = false;
    std::mutex starting;                                      ///< Held where `running` changes, or must not.
    std::atomic<std::thread::id> inFrame = std::thread::id(); ///< The thread whose frame callback is called.
};
