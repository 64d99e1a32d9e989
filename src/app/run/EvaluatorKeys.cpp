// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "curlew/base/InputFile.h"
#include "curlew/base/LocalFile.h"

namespace curlew::app {

// Digests of everything that a value depends on.

namespace {

void addMoment(DigestBuilder& key, const Moment& moment) { key.add(moment.frame).add(moment.time).add(moment.fps); }

/// Adds the size and modification time of a file, so that a changed file is read again.
void addFile(DigestBuilder& key, const std::string& file) {
    std::error_code error;
    const auto size = std::filesystem::file_size(file, error);
    key.add(file).add(error ? uint64_t{0} : size);
    const auto time = std::filesystem::last_write_time(file, error);
    key.add(error ? int64_t{0} : static_cast<int64_t>(time.time_since_epoch().count()));
}

} // namespace

Digest Evaluator::keyOf(const Link& link) const {
    switch (link.from) {
        case Link::From::node:
            return mResults[link.index] ? DigestBuilder().add(mResults[link.index]->key).add(link.output).digest()
                                        : Digest{};
        case Link::From::state:
            return mStates[link.index].key;
        case Link::From::given:
            break;
    }
    return mSession.mGiven.at(link.index).key;
}

Digest Evaluator::keyOf(size_t index) const {
    const Node& node = mGraph.nodes[index];
    const Action& action = node.action();
    DigestBuilder key;
    key.add(action.name);
    for (const auto& word : node.arguments.writtenWords()) key.add(word);
    for (const auto& [name, value] : node.arguments.written())
        if (const Option& option = *action.option(name); !option.selects && option.type != OptionType::ages)
            key.add(name).add(value);
    for (const auto& links : node.inputs) {
        key.add(links.size());
        for (const Link& link : links) key.add(keyOf(link));
    }
    if (action.changes(node.arguments)) addMoment(key, mNow);
    if (mInParts[index] || node.arguments.usesPart()) key.add(mNow.part).add(mParts);
    if (node.arguments.usesRate()) key.add(mNow.fps);
    // The change of the inputs between frames matters too. Their current keys cover it, since they contain the
    // expressions.
    if (mClock && action.advances(node.arguments)) {
        addMoment(key, mNow);
        key.add(mClock->begin).add(mClock->duration).add(mClock->substeps).add(mMemories[index].sum);
    }
    if (action.evaluation == Evaluation::file) {
        const Arguments now = node.arguments.at(mNow);
        for (const auto& word : now.words()) {
            const auto provided = mSession.mProvided.find(word);
            if (provided != mSession.mProvided.end())
                key.add(provided->second.content);
            else
                addFile(key, word);
        }
    }
    if (action.readsReport) {
        Json figures = mSession.report;
        figures.erase("actions"); // which contains times
        key.add(figures.dump());
    }
    return key.digest();
}

Digest Evaluator::programDigest() const {
    DigestBuilder key;
    key.add(fmt::format("frames {}x{} fps={} substeps={} part={}/{}", mPlan->start, mPlan->by, mPlan->fps,
                        mPlan->substeps, mPlan->part, mPlan->parts));
    for (const Node& node : mGraph.nodes) {
        if (node.action().setting) continue;
        key.add(node.name).add(node.arguments.program());
        for (const auto& links : node.inputs)
            for (const Link& link : links) key.add(app::nameOf(mGraph, link));
    }
    return key.digest();
}

void Evaluator::addInputs(DigestBuilder& key, const Node& node, const Moment& moment) const {
    const Arguments now = node.arguments.at(moment);
    for (const auto& word : now.words()) {
        const auto provided = mSession.mProvided.find(word);
        if (provided != mSession.mProvided.end())
            key.add(provided->second.content);
        else if (!isStream(word)) // a stream can only be read once
            key.add(digestOf(word));
    }
}

/// Returns the digest of the files that are the same in all frames. Skips nodes that are not needed, since they read no
/// files.
Digest Evaluator::inputsBefore() const {
    DigestBuilder key;
    for (size_t k = 0; k < mGraph.nodes.size(); ++k) {
        const Node& node = mGraph.nodes[k];
        if (mNeeded[k] && node.action().evaluation == Evaluation::file &&
            (k < mGraph.frames || !node.arguments.changes()))
            addInputs(key, node, beforeFrames(mFirstPart));
    }
    return key.digest();
}

/// Returns the digest extended by the files of a frame.
Digest Evaluator::inputsOf(const Digest& before, const Moment& moment) const {
    DigestBuilder key;
    key.add(before);
    for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k) {
        const Node& node = mGraph.nodes[k];
        if (mNeeded[k] && node.action().evaluation == Evaluation::file && node.arguments.changes())
            addInputs(key, node, moment);
    }
    return key.digest();
}

} // namespace curlew::app
