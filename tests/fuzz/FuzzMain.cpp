// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry points: curlew_fuzz --target=NAME CORPUS… [-max_total_time=SECONDS …]. With --seeds=FOLDER it
// writes the seeds of all targets to that folder.

#include "Targets.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

namespace {

const curlew::fuzz::Target* chosen = nullptr;

void writeSeeds(const std::filesystem::path& folder) {
    for (const auto& target : curlew::fuzz::targets()) {
        std::filesystem::create_directories(folder / target.name);
        int number = 0;
        for (const std::string& seed : curlew::fuzz::seeds(target.name))
            std::ofstream(folder / target.name / std::to_string(number++), std::ios::binary) << seed;
        std::cout << target.name << '\n';
    }
}

} // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
    for (int k = 1; k < *count; ++k) {
        const std::string argument = (*arguments)[k];
        if (argument.starts_with("--seeds=")) {
            writeSeeds(argument.substr(8));
            std::exit(EXIT_SUCCESS);
        }
        for (const auto& target : curlew::fuzz::targets())
            if (argument == std::string("--target=") + target.name) chosen = &target;
    }
    if (!chosen) {
        std::cerr << "give --target=NAME or --seeds=FOLDER\n";
        std::exit(EXIT_FAILURE);
    }
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    chosen->read({reinterpret_cast<const char*>(data), size});
    return 0;
}
