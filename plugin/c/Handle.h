// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Guard.h"
#include "curlew/vdb/Openvdb.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

namespace curlew::c {

/// The callbacks of a program's caller, and whether a callback or curlew_cancel() has asked the program to stop.
class Caller {
  public:
    void begin(const curlew_callbacks* callbacks);
    void end();
    void cancel() { mCancelled = true; }

    /// Returns a listener that passes the program's output to the callbacks.
    app::Listener listener();
    void frame(int frame);

  private:
    void message(std::string_view text) const;
    void progress(const app::Progress& progress);
    bool cancelled();
    /// Calls the progress callback if enough time has passed since the last call. The lock must be held.
    void tell();

    curlew_callbacks mCallbacks{};
    std::atomic<bool> mCancelled = false;
    std::mutex mTelling;
    std::string mTitle;
    double mFraction = 0;
    std::chrono::steady_clock::time_point mTold{};
};

} // namespace curlew::c

/// A session of the C interface.
struct curlew_session {
    /// Marks the session as running during its lifetime. Throws ValueError if the session is running already.
    class Running;
    static constexpr int64_t kFound = int64_t{1} << 32;
    /// Returns the session for reading. While it runs, only its frame callback may read it; otherwise throws
    /// ValueError.
    const curlew::app::Session& readable() const;
    /// Returns the session for modification. Throws ValueError while it runs.
    curlew::app::Session& writable();

    curlew::c::Caller caller;
    curlew::app::Console console{caller.listener()};
    curlew::app::Session session{console};
    mutable std::string text; ///< The text that was returned last.
    /// Results that curlew_find() has returned since the run or the frame began. Their positions begin at firstFound,
    /// and are never used again.
    mutable std::vector<curlew::app::Session::Held> found;
    mutable std::map<std::string, int64_t, std::less<>> foundAs; ///< The positions by name.
    int64_t firstFound = kFound;
    void forgetFound();
    mutable std::vector<const void*> leaves; ///< The leaves of the grid whose leaves were read last.
    mutable openvdb::GridBase::ConstPtr leavesOf;

    /// Returns the object of a kind at a position: its age among the objects of that kind, or a position from
    /// curlew_find(). Throws ValueError if there is none.
    const curlew::app::Session::Held& object(curlew_kind kind, int64_t position) const;
    size_t count(curlew_kind kind) const;

    std::atomic<bool> running = false;
    std::mutex starting;                                      ///< Held while `running` changes, or must not change.
    std::atomic<std::thread::id> inFrame = std::thread::id(); ///< The thread that is executing the frame callback.
};
