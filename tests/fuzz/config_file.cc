// The file of all services' options.
#include "config/config_file.h"

#include "fuzz/fuzz.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  ParseConfigFile(fuzz::ToText(data, size), "file").ok();
  return 0;
}
