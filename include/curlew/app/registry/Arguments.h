// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Expression.h"
#include "curlew/app/registry/Option.h"
#include "curlew/math/Range.h"
#include "curlew/math/Vec.h"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace curlew::app {

struct Action;

/// The options and words given to one use of an action, checked against its declaration. Reading an option that was not
/// declared, or as another type, is a programming error (std::logic_error). Values and words may contain expressions
/// (Expression.h); reading one gives its value at one moment: the default moment, or the one that at() was given.
class Arguments {
  public:
    explicit Arguments(const Action& action) : mAction(&action) {}

    const Action& action() const { return *mAction; }
    const std::vector<std::string>& words() const { return mWords; }

    bool given(std::string_view name) const { return mValues.contains(name); }
    bool flag(std::string_view name) const;
    int64_t integer(std::string_view name) const;
    template <class T>
    T integer(std::string_view name) const {
        return static_cast<T>(integer(name));
    }
    double real(std::string_view name) const; ///< Also of a length; ValueError if that is still relative.
    Vec3d vector(std::string_view name) const;
    Box box(std::string_view name) const;
    Range interval(std::string_view name) const;
    /// The number of numbers in a list of coordinates.
    int count(std::string_view name) const;
    /// Throws ValueError unless one number was given, or N.
    template <int N>
    Vec<double, N> coordinates(std::string_view name) const {
        Vec<double, N> v;
        const std::vector<double> numbers = coordinateList(name, N);
        for (int i = 0; i < N; ++i) v[i] = numbers[static_cast<size_t>(i)];
        return v;
    }
    std::string text(std::string_view name) const; ///< Also of a choice: its word.
    std::vector<size_t> ages(std::string_view name) const;

    size_t choice(std::string_view name) const; ///< The position of the word among the choices.
    /// The enumerator whose name is the word: the choices are the names of an enumeration, in its order.
    template <class Enum>
    Enum choice(std::string_view name) const {
        return static_cast<Enum>(choice(name));
    }

    /// Adds one token, option=value or a word. Throws ValueError naming the nearest valid option or the valid values;
    /// values that depend on a variable are only checked by at().
    void add(const std::string& token);
    /// Adds a word, whatever it looks like.
    void addWord(const std::string& word);
    /// Gives an option, by its full name or a unique beginning of it, a value. Throws ValueError as add() does.
    void set(const std::string& name, const std::string& value);
    /// Gives options that others imply their values. Throws ValueError if words are missing, or if one option leaves
    /// another without effect.
    void finish();

    /// The same at that moment. Throws ValueError if a value is not valid then.
    Arguments at(const Moment& moment) const;
    /// Whether lengths are given as parts of an object's size (5%), and the same in world units for an object whose box
    /// has this diagonal.
    bool hasRelativeLengths() const;
    Arguments relativeTo(double diagonal) const;
    /// Whether a value or word changes with time.
    bool changes() const;

    /// What was given, expressions and all: words, and options by name.
    const std::vector<std::string>& writtenWords() const { return mWrittenWords; }
    const std::map<std::string, std::string, std::less<>>& written() const { return mWritten; }
    /// The action as it was given, expressions and all, to run again: "-noise type=psrd seed=2".
    std::string program(bool withDash = true) const;

  private:
    const Option& option(std::string_view name, OptionType type) const;
    std::vector<double> coordinateList(std::string_view name, size_t axes) const;
    std::string value(const Option& option) const;

    const Action* mAction;
    std::vector<std::string> mWords, mWrittenWords;
    std::map<std::string, std::string, std::less<>> mValues, mWritten;
};

/// A word as a line of a scene has it, quoted if need be.
std::string quoted(const std::string& word);

} // namespace curlew::app
