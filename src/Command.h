// SPDX-License-Identifier: Apache-2.0
#pragma once

/// The command `curlew`: runs a command line, reports its errors and returns the exit status. It sets the signal
/// handlers of the process, so it is for programs that do nothing else. Not part of the interface of libcurlew
/// (plugin/c/curlew.h), which only exports it for the small program in packages.
extern "C" __attribute__((visibility("default"))) int curlew_command(int argc, char** argv); // NOLINT: a name in C
