// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/IsolatedModel.h"

namespace curlew::app {

namespace {

/// The side that writes: each of its functions has a twin in Take.
class Write {
  public:
    explicit Write(PartWriter& parts) : mParts(parts) {}

    void text(const std::string& text) { mParts.text(text); }
    template <class T>
    void array(const std::vector<T>& values) {
        mParts.array(values);
    }
    template <class T>
    void value(const T& value) {
        mParts.array(std::vector<T>{value});
    }
    void optional(const std::optional<uint32_t>& number) {
        mParts.array(number ? std::vector<uint32_t>{*number} : std::vector<uint32_t>{});
    }
    template <class T, class Each>
    void list(const std::vector<T>& items, const Each& each) {
        value(uint64_t{items.size()});
        for (const T& item : items) each(item);
    }

  private:
    PartWriter& mParts;
};

class Take {
  public:
    explicit Take(PartReader& parts) : mParts(parts) {}

    void text(std::string& text) { text = mParts.text(); }
    template <class T>
    void array(std::vector<T>& values) {
        values = mParts.array<T>();
    }
    template <class T>
    void value(T& value) {
        const auto values = mParts.array<T>();
        if (values.size() != 1) throw mParts.damaged();
        value = values.front();
    }
    void optional(std::optional<uint32_t>& number) {
        const auto values = mParts.array<uint32_t>();
        if (values.size() > 1) throw mParts.damaged();
        if (!values.empty()) number = values.front();
    }
    template <class T, class Each>
    void list(std::vector<T>& items, const Each& each) {
        uint64_t size = 0;
        value(size);
        if (size > mParts.left()) throw mParts.damaged(); // every item takes more than a byte
        for (; size > 0; --size) each(items.emplace_back());
    }

  private:
    PartReader& mParts;
};

/// One description of the data for both sides. Data: const ModelData to write, ModelData to take.
template <class Side, class Data>
void hand(Side side, Data& data) {
    side.list(data.nodes, [&](auto& node) {
        side.text(node.name);
        side.optional(node.parent);
        side.value(node.local);
    });
    side.list(data.parts, [&](auto& part) {
        side.value(part.node);
        side.array(part.points);
        side.array(part.corners);
        side.array(part.sizes);
        side.array(part.bones);
        side.array(part.influences);
        side.array(part.firstInfluence);
        side.list(part.targets, [&](auto& target) {
            side.value(target.weight);
            side.array(target.offsets);
        });
    });
    const auto keys = [&](auto& of) {
        side.array(of.times);
        side.array(of.values);
    };
    side.list(data.clips, [&](auto& clip) {
        side.text(clip.name);
        side.value(clip.begin);
        side.value(clip.end);
        side.list(clip.nodes, [&](auto& channel) {
            side.value(channel.node);
            keys(channel.translation);
            keys(channel.rotation);
            keys(channel.scale);
        });
        side.list(clip.morphs, [&](auto& channel) {
            side.value(channel.part);
            side.array(channel.weights.times);
            side.list(channel.weights.values, [&](auto& weights) { side.array(weights); });
        });
    });
    side.text(data.units);
}

} // namespace

void writeModel(const ModelData& data, PartWriter& parts) { hand(Write(parts), data); }

ModelData takeModel(PartReader& parts) {
    ModelData data;
    hand(Take(parts), data);
    if (!isConsistent(data)) throw parts.damaged();
    return data;
}

} // namespace curlew::app
