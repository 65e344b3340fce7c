// Tries inputs of the fuzzer where there is no libFuzzer: replay FILE, a stream of inputs with the length of each before it.
#include "tools.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

int main(int count, char** words) {
    const std::vector<Bytes> inputs = read_files(count == 2 ? words[1] : "");
    for (const Bytes& one : inputs) LLVMFuzzerTestOneInput(one.data(), one.size());
    std::printf("%zu inputs\n", inputs.size());
    return 0;
}
