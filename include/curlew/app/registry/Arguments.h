// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Expression.h"
#include "curlew/app/registry/Option.h"
#include "curlew/math/Interval.h"
#include "curlew/math/Vec.h"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace curlew::app {

struct Action;

/// The options and words given to one use of an action, checked against its declaration. Reading an undeclared option,
/// or an option as another type, is a programming error (std::logic_error). Values and words may contain expressions
/// (Expression.h). Reading such a value evaluates it at the default moment, or at the moment passed to at().
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
    /// Also reads a length. Throws ValueError if the length is still relative.
    double real(std::string_view name) const;
    Vec3d vector(std::string_view name) const;
    Box box(std::string_view name) const;
    Interval interval(std::string_view name) const;
    /// Returns how many numbers a list of coordinates has.
    int count(std::string_view name) const;
    /// Throws ValueError unless 1 or N numbers were given.
    template <int N>
    Vec<double, N> coordinates(std::string_view name) const {
        Vec<double, N> v;
        const std::vector<double> numbers = coordinateList(name, N);
        for (int i = 0; i < N; ++i) v[i] = numbers[static_cast<size_t>(i)];
        return v;
    }
    std::string text(std::string_view name) const; ///< For a choice, returns its word.
    std::vector<size_t> ages(std::string_view name) const;

    size_t choice(std::string_view name) const; ///< Returns the index of the word among the choices.
    /// Returns the enumerator that the word names. The choices must list the enumeration in its order.
    template <class Enum>
    Enum choice(std::string_view name) const {
        return static_cast<Enum>(choice(name));
    }

    /// Adds one token: option=value or a word. Throws ValueError, naming the nearest valid option or the valid values,
    /// if the token is invalid. Values that depend on a variable are only checked by at().
    void add(const std::string& token);
    /// Adds a word, even if it looks like an option.
    void addWord(const std::string& word);
    /// Sets an option, given its name or a unique prefix of it. Throws ValueError as add() does.
    void set(const std::string& name, const std::string& text);
    /// Sets the values that some options imply for others. Throws ValueError if words are missing, or if one option
    /// leaves another without effect.
    void finish();

    /// Returns one sentence for each option that is given, but has no effect with the others (Option::onlyWith).
    std::vector<std::string> withoutEffect() const;

    /// Returns the arguments evaluated at a moment. Throws ValueError if a value is invalid at that moment.
    Arguments at(const Moment& moment) const;
    /// Returns whether a length is relative to an object's size (5%). relativeTo() returns the arguments with such
    /// lengths in world units, for an object whose bounding box has this diagonal.
    bool hasRelativeLengths() const;
    Arguments relativeTo(double diagonal) const;
    /// Returns whether a value or word changes with time.
    bool changes() const;
    /// Returns whether a word or an option changes from part to part (P in an expression).
    bool usesPart() const;
    /// Returns whether a word or an option depends on the frame rate (fps in an expression).
    bool usesRate() const;

    /// The words, and the options by name, as given: expressions are not evaluated.
    const std::vector<std::string>& writtenWords() const { return mWrittenWords; }
    const std::map<std::string, std::string, std::less<>>& written() const { return mWritten; }
    /// Returns the action as it was given, expressions not evaluated, as text that can be run again: "-noise type=psrd
    /// seed=2".
    std::string program(bool withDash = true) const;

  private:
    bool uses(bool Variables::*variable) const;
    const Option& option(std::string_view name, OptionType type) const;
    std::vector<double> coordinateList(std::string_view name, size_t axes) const;
    std::string value(const Option& option) const;

    const Action* mAction;
    std::vector<std::string> mWords, mWrittenWords;
    std::map<std::string, std::string, std::less<>> mValues, mWritten;
};

/// Returns a word as a scene's line contains it, in quotes if necessary.
std::string quoted(const std::string& word);

} // namespace curlew::app
