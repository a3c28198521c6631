#include <gtest/gtest.h>

#include "features/onnx_network.h"
#include "testing/test_onnx.h"

namespace skein::onnx_network_opencv_test {

TEST(OnnxByOpenCv, SaysWhichOpsetFailed) {
  const std::string model = TestOnnx(11)
                                .Input("x", {1, 3, 2, 2})
                                .Node("NoSuchLayer", {"x"}, "y")
                                .Output("y", {1, 3})
                                .Model();
  auto network = ReadOnnxNetwork({model.begin(), model.end()});
  ASSERT_TRUE(network.ok()) << network.error();
  const std::string error = (*network)->Run({{1, 3, 2, 2}, std::vector<float>(12)}, "").error();
  EXPECT_EQ(error.find("cannot be run by OpenCV (opset 11): "), 0u) << error;
  EXPECT_NE(error.find("opset_version=10"), std::string::npos) << error;
}

TEST(OnnxByOpenCv, RefusesAModelThatEndsTooEarly) {
  const std::string model = TestOnnx(11)
                                .Input("x", {1, 3, 2, 2})
                                .Node("Relu", {"x"}, "y")
                                .Output("y", {1, 3, 2, 2})
                                .Model();
  for (size_t size = 3; size + 8 < model.size(); ++size) {
    const auto network = ReadOnnxNetwork({model.begin(), model.begin() + size});
    EXPECT_EQ(network.error(), "is no ONNX model, or damaged") << size << " bytes";
  }
}

}  // namespace skein::onnx_network_opencv_test
