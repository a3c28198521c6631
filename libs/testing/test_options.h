#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

namespace skein {

// A value that makes no sense, and what the error must name.
template <class Options>
struct OptionFault {
  std::string name;
  std::function<void(Options*)> set;
};

// The default options pass Check(); each fault alone fails with its option's name in the text.
template <class Options>
void ExpectChecked(const std::vector<OptionFault<Options>>& faults) {
  const Options defaults;
  EXPECT_TRUE(defaults.Check().ok()) << defaults.Check().error();
  for (const OptionFault<Options>& fault : faults) {
    Options options;
    fault.set(&options);
    const std::string error = options.Check().error();
    EXPECT_NE(error.find(fault.name), std::string::npos) << fault.name << ": \"" << error << "\"";
  }
}

}  // namespace skein
