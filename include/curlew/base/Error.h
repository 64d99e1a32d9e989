// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace curlew {

/// Root of everything the library throws on purpose. `what()` is one line for the user: what is wrong, where, and
/// what to do about it.
class Error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// A value that a caller gave is unusable: it names the value and the valid choices.
class ValueError : public Error {
  public:
    using Error::Error;
};

/// A file cannot be read or written: it names the file.
class FileError : public Error {
  public:
    using Error::Error;
};

/// A request that this machine cannot satisfy (memory): it says how much it needs.
class ResourceError : public Error {
  public:
    using Error::Error;
};

/// The user asked to stop.
class Interrupted : public Error {
  public:
    Interrupted() : Error("interrupted") {}
};

} // namespace curlew
