// SPDX-License-Identifier: Apache-2.0
#include "Command.h"

int main(int argc, char** argv) { return curlew_command(argc, argv); }
