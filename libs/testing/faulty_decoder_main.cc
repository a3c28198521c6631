// For tests: a decoder that fails as the name says under which it is started. A photo makes it
//   crash, abort, kill   end by SIGSEGV, SIGABRT or SIGKILL
//   exit           end with exit code 3
//   sleep, spin    never answer, without and with use of the processor
//   eat            take memory until there is none, then say how many MiB
//   babble         answer what is no message
//   lie            answer values that no photo has
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <string>

#include "photo/decoder_wire.h"

namespace {

using namespace skein;

void Send(const Bytes& message) {
  if (write(kDecoderSocket, message.data(), message.size()) < 0) _exit(1);
}

uint64_t AddressSpace() {
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

std::string EatenMib() {
  constexpr size_t kMib = 1 << 20;
  size_t eaten = 0;
  // Enough to notice a limit that is not there, not enough to harm the machine.
  while (eaten < 4000) {
    void* block = std::malloc(kMib);
    if (block == nullptr) break;
    std::memset(block, 1, 1);
    ++eaten;
  }
  return std::to_string(eaten);
}

void Fail(const std::string& how) {
  DecoderAnswer answer;
  if (how == "crash") raise(SIGSEGV);
  if (how == "abort") std::abort();
  if (how == "kill") raise(SIGKILL);
  if (how == "exit") _exit(3);
  if (how == "sleep") pause();
  while (how == "spin") clock();
  if (how == "babble") Send({1, 2, 3});
  if (how == "eat") {
    answer.status = DataLoss(EatenMib());
    Send(EncodeDecoderAnswer(answer));
  }
  if (how == "lie") {
    answer.exif.orientation = 77;
    Send(EncodeDecoderAnswer(answer));
  }
}

}  // namespace

int main(int, char** argv) {
  const std::string path = argv[0];
  const std::string how = path.substr(path.rfind('/') + 1);
  DecoderAnswer ready;
  ready.address_space_bytes = AddressSpace();
  Send(EncodeDecoderAnswer(ready));
  Bytes message(kMaxDecoderMessage);
  while (read(kDecoderSocket, message.data(), message.size()) > 0) Fail(how);
  return 0;
}
