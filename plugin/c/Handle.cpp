// SPDX-License-Identifier: Apache-2.0
#include "Handle.h"

#include "curlew/base/Parallel.h"

using namespace curlew;

namespace curlew::c {

void Caller::begin(const curlew_callbacks* callbacks) {
    mCallbacks = callbacks ? *callbacks : curlew_callbacks{};
    mCancelled = false;
    mTitle.clear();
    mFraction = 0;
    mTold = {};
}

void Caller::end() { mCallbacks = {}; }

app::Listener Caller::listener() {
    return {.info = [this](std::string_view line) { message(line); },
            .print = [this](std::string_view text) { message(text); },
            .progress = [this](const app::Progress& now) { progress(now); },
            .cancelled = [this] { return cancelled(); }};
}

void Caller::frame(int frame) {
    if (mCallbacks.frame && mCallbacks.frame(mCallbacks.user, frame) != 0) cancel();
    if (mCancelled) throw Interrupted();
}

void Caller::message(std::string_view text) const {
    if (mCallbacks.message) mCallbacks.message(mCallbacks.user, std::string(text).c_str());
}

void Caller::progress(const app::Progress& progress) {
    if (!mCallbacks.progress) return;
    const std::lock_guard lock(mTelling);
    if (mTitle != progress.title) mTitle = progress.title;
    mFraction = progress.fraction;
    tell();
}

bool Caller::cancelled() {
    // Asks the caller here too, since an action may not report progress for a long time.
    if (mCallbacks.progress && !mCancelled)
        if (const std::unique_lock lock(mTelling, std::try_to_lock); lock) tell();
    return mCancelled;
}

void Caller::tell() {
    constexpr auto kEvery = std::chrono::milliseconds(50);
    const auto now = std::chrono::steady_clock::now();
    if (mCancelled || now - mTold < kEvery) return;
    mTold = now;
    isolated([&] { // it may evaluate flows
        if (mCallbacks.progress(mCallbacks.user, mTitle.c_str(), mFraction) != 0) cancel();
    });
}

} // namespace curlew::c

const app::Session& curlew_session::readable() const {
    if (running && inFrame != std::this_thread::get_id())
        throw ValueError("the session is running; only its frame callback may read its results");
    return session;
}

app::Session& curlew_session::writable() {
    if (running) throw ValueError("the session is running");
    return session;
}
