#include "core/log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "core/one_line.h"

namespace skein::log_test {

TEST(Log, ATextStaysOneLineAndDoesNothingToATerminal) {
  EXPECT_EQ(OneLine("a\nready ingest\r\x1b[2J\x7f"), "a\\x0aready ingest\\x0d\\x1b[2J\\x7f");
  EXPECT_EQ(OneLine("\xc2\x9b"
                    "31m"),
            "\\x9b31m")
      << "C1 in UTF-8";
  EXPECT_EQ(OneLine("Gr\xc3\xbc\xc3\x9f"
                    "e/IMG (1).jpg"),
            "Gr\xc3\xbc\xc3\x9f"
            "e/IMG (1).jpg");
}

// As it would if a session's log were a link to a shell's start-up file.
TEST(Log, WhatIsWrittenToAFileIsACommentToAShell) {
  char name[] = "/tmp/skein_log_test_XXXXXX";
  const std::string folder = ::mkdtemp(name);
  const std::string log = folder + "/log", mark = folder + "/mark";
  const int before = ::dup(2);
  FILE* file = ::freopen(log.c_str(), "w", stderr);
  ASSERT_NE(file, nullptr);
  InitLog("test", false);
  LogInfo("stored {}", "$(touch " + mark + ").jpg");
  LogInfo("stored {}", "x\ntouch " + mark + "\n;touch " + mark + ";`touch " + mark + "`.jpg");
  std::fflush(stderr);
  ::dup2(before, 2);
  ::close(before);
  EXPECT_EQ(std::system(("bash -c 'source " + log + "'").c_str()), 0);
  EXPECT_NE(std::system(("test -e " + mark).c_str()), 0);
  EXPECT_EQ(std::system(("test $(wc -l <" + log + ") = 2").c_str()), 0);
  std::system(("rm -r " + folder).c_str());
}

}  // namespace skein::log_test
