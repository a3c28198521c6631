#include "clients/demand.h"

#include <gtest/gtest.h>

namespace skein::demand_command_test {

TEST(MappersWanted, IsASentenceForAUser) {
  EXPECT_EQ(MappersWanted(0), "enough mappers");
  EXPECT_EQ(MappersWanted(1), "1 more mapper wanted");
  EXPECT_EQ(MappersWanted(2), "2 more mappers wanted");
}

}  // namespace skein::demand_command_test
