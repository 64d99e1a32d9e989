// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Options.h"

#include <fmt/format.h>

#include <optional>

namespace curlew::app {

/// True for an optional enumeration. Its option's first choice means nullopt.
template <class>
inline constexpr bool kOptionalEnum = false;
template <class Enum>
inline constexpr bool kOptionalEnum<std::optional<Enum>> = std::is_enum_v<Enum>;

/// Binds options of an action to the members of a struct. Each option is declared once and has the member's default;
/// read() fills the struct from the given arguments.
template <class Struct>
class Binding {
  public:
    explicit Binding(const Struct& defaults = {}) : mDefaults(defaults) {}

    /// Binds an option to the member that `get` returns a reference to. The member's default becomes the option's.
    template <class Get>
    Binding& add(Option option, Get get) {
        option.fallback = textOf(option, get(mDefaults));
        return bind(std::move(option), get, false);
    }
    /// Binds an option to a member whose default is not a valid value of the option (0: the library chooses). The
    /// option is only read if it is given.
    template <class Get>
    Binding& addOptional(Option option, Get get) {
        return bind(std::move(option), get, true);
    }
    /// Adds the options of a member that is itself a bound struct.
    template <class Other, class Get>
    Binding& include(const Binding<Other>& other, Get get) {
        for (const Option& option : other.options()) mOptions.push_back(option);
        mReaders.push_back([other, get](const Arguments& a, Struct& target) { other.read(a, get(target)); });
        return *this;
    }

    const std::vector<Option>& options() const { return mOptions; }
    void read(const Arguments& a, Struct& target) const {
        for (const auto& reader : mReaders) reader(a, target);
    }
    Struct read(const Arguments& a) const {
        Struct target = mDefaults;
        read(a, target);
        return target;
    }

  private:
    template <class Get>
    Binding& bind(Option option, Get get, bool onlyIfGiven) {
        mReaders.push_back(
            [name = option.name, type = option.type, get, onlyIfGiven](const Arguments& a, Struct& target) {
                if (!onlyIfGiven || a.given(name)) assign(a, name, type, get(target));
            });
        mOptions.push_back(std::move(option));
        return *this;
    }

    template <class Member>
    static std::string textOf(const Option& option, const Member& value) {
        if constexpr (std::is_enum_v<Member>)
            return option.choices.at(static_cast<size_t>(value));
        else if constexpr (kOptionalEnum<Member>)
            return option.choices.at(value ? static_cast<size_t>(*value) + 1 : 0);
        else if constexpr (std::is_same_v<Member, bool>)
            return option.type == OptionType::choice ? option.choices.at(value ? 1 : 0) : value ? "1" : "0";
        else
            return fmt::format("{}", value);
    }

    template <class Member>
    static void assign(const Arguments& a, const std::string& name, OptionType type, Member& member) {
        if constexpr (std::is_enum_v<Member>)
            member = static_cast<Member>(a.choice(name));
        else if constexpr (kOptionalEnum<Member>)
            member =
                a.choice(name) == 0 ? Member{} : Member{static_cast<typename Member::value_type>(a.choice(name) - 1)};
        else if constexpr (std::is_same_v<Member, bool>)
            member = type == OptionType::choice ? a.choice(name) == 1 : a.flag(name);
        else if constexpr (std::is_integral_v<Member>)
            member = static_cast<Member>(a.integer(name));
        else
            member = type == OptionType::integer ? static_cast<double>(a.integer(name)) : a.real(name);
    }

    Struct mDefaults;
    std::vector<Option> mOptions;
    std::vector<std::function<void(const Arguments&, Struct&)>> mReaders;
};

} // namespace curlew::app
