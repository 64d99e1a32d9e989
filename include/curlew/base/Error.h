// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace curlew {

/// Base class of every error that the library throws on purpose. `what()` is one line for the user: what is wrong,
/// where, and what to do about it.
class Error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// The caller gave an unusable value. The message names the value and the valid choices.
class ValueError : public Error {
  public:
    using Error::Error;
};

/// A file cannot be read or written. The message names the file.
class FileError : public Error {
  public:
    using Error::Error;
};

/// This machine cannot satisfy the request (memory). The message says how much is needed.
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
