#pragma once

#include "curlew/app/Program.h"

#include <optional>

namespace curlew::app {

/// Runs a program: once, and what follows -frames once for each frame.
class Runner {
  public:
    Runner(const Program& program, Session& session);
    void run();

  private:
    struct Took {
        std::optional<size_t> entry = {}; ///< Where the report has it.
        double seconds = 0;
    };

    const Arguments& action(size_t k) const { return mProgram.actions[k]; }
    /// The session is at that action from here on. Its name.
    const std::string& enter(size_t k) const;
    /// Whether one of the actions [begin, end) changes with time.
    bool changes(size_t begin, size_t end) const;
    void prepare() const;
    void prepareFrames() const;
    void runAction(size_t k, const std::string& place);
    void runFrames();
    void sayShares() const;

    const Program& mProgram;
    Session& mSession;
    std::vector<Took> mTook; ///< By action, all frames together.
    size_t mFrames;          ///< The position of -frames; the size of the program where there is none.
    bool mResume = false;
};

} // namespace curlew::app
