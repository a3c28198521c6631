#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>

#include "features/onnx_descriptor.h"
#include "features/onnx_network.h"
#include "testing/test_folder.h"
#include "testing/test_onnx.h"

namespace skein::onnx_network_runtime_test {

Bytes ToBytes(const std::string& text) { return {text.begin(), text.end()}; }

// 0, 1, 2, ... as 1 x 3 x height x width.
OnnxTensor Counting(int64_t height, int64_t width) {
  OnnxTensor tensor{{1, 3, height, width}, std::vector<float>(3 * height * width)};
  std::iota(tensor.values.begin(), tensor.values.end(), 0.f);
  return tensor;
}

// The mean of each channel, of any size: Shape with `end` is of opset 15, ReduceMean with axes as
// an input of opset 18.
std::string OpenMeanColour() {
  return TestOnnx(18)
      .Input("x", {-1, 3, -1, -1})
      .Weights("rest", std::vector<int64_t>{-1})
      .Weights("axes", std::vector<int64_t>{2})
      .Node("Shape", {"x"}, "begin", TestOnnx::Attribute("end", 2))
      .Node("Concat", {"begin", "rest"}, "flat", TestOnnx::Attribute("axis", 0))
      .Node("Reshape", {"x", "flat"}, "pixels")
      .Node("ReduceMean", {"pixels", "axes"}, "y", TestOnnx::Attribute("keepdims", 0))
      .Output("y", {-1, 3})
      .Model();
}

std::string ErrorOf(const std::string& model) {
  auto network = ReadOnnxNetwork(ToBytes(model));
  if (!network) return network.error();
  return (*network)->Run(Counting(2, 2), "").error();
}

size_t CountThreads() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return std::distance(begin(tasks), end(tasks));
}

TEST(OnnxRuntime, RunsNewOpsetsOfOpenSizes) {
  auto network = ReadOnnxNetwork(ToBytes(OpenMeanColour()));
  ASSERT_TRUE(network.ok()) << network.error();
  EXPECT_EQ((*network)->inputs().at(0).shape, (std::vector<int64_t>{-1, 3, -1, -1}));
  const auto small = (*network)->Run(Counting(2, 2), "");
  ASSERT_TRUE(small.ok()) << small.error();
  EXPECT_EQ(small->values, (std::vector<float>{1.5, 5.5, 9.5}));
  const auto large = (*network)->Run(Counting(2, 3), "y");
  ASSERT_TRUE(large.ok()) << large.error();
  EXPECT_EQ(large->values, (std::vector<float>{2.5, 8.5, 14.5}));
  EXPECT_EQ(large->shape, (std::vector<int64_t>{1, 3}));
}

TEST(OnnxRuntime, RunsOnTheCallersThreadAlone) {
  const size_t num_threads = CountThreads();
  auto network = ReadOnnxNetwork(ToBytes(OpenMeanColour()));
  ASSERT_TRUE(network.ok()) << network.error();
  ASSERT_TRUE((*network)->Run(Counting(200, 300), "").ok());
  EXPECT_EQ(CountThreads(), num_threads);
}

// The first session of a process is the one that would.
TEST(OnnxRuntimeDeathTest, WritesNothingToStandardError) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(std::exit(ErrorOf(OpenMeanColour()).empty() ? 0 : 1), testing::ExitedWithCode(0),
              testing::Eq(""));
}

TEST(OnnxRuntime, SaysWhichOperatorIsUnknown) {
  const std::string error = ErrorOf(TestOnnx(18)
                                        .Input("x", {1, 3, 2, 2})
                                        .Node("NoSuchLayer", {"x"}, "y")
                                        .Output("y", {1, 3})
                                        .Model());
  EXPECT_EQ(error.find("cannot be run by ONNX Runtime 1."), 0u) << error;
  EXPECT_NE(error.find("No Op registered for NoSuchLayer"), std::string::npos) << error;
  EXPECT_NE(error.find("; export it with torch.onnx.export("), std::string::npos) << error;
}

TEST(OnnxRuntime, RefusesAnOutputOfIntegers) {
  const std::string error = ErrorOf(TestOnnx(18)
                                        .Input("x", {1, 3, 2, 2})
                                        .Node("Shape", {"x"}, "y")
                                        .OutputOfIntegers("y", {4})
                                        .Model());
  EXPECT_EQ(error.find("puts out no 32-bit floats; export it with"), 0u) << error;
}

TEST(OnnxRuntime, SaysHowToJoinWeightsOfAnotherFile) {
  const std::string error = ErrorOf(TestOnnx(18)
                                        .Input("x", {1, 3, 2, 2})
                                        .WeightsElsewhere("w", 2, "weights.bin")
                                        .Node("Add", {"x", "w"}, "y")
                                        .Output("y", {1, 3, 2, 2})
                                        .Model());
  EXPECT_EQ(error.find("keeps its weights in another file"), 0u) << error;
  EXPECT_NE(error.find("onnx.save(onnx.load("), std::string::npos) << error;
}

// y: the values above 0, as many as there are.
TEST(OnnxRuntime, ADescriptorOfAnotherLengthThrows) {
  const TestFolder folder;
  const std::string path = folder / "m.onnx";
  std::ofstream(path, std::ios::binary) << TestOnnx(18)
                                               .Input("x", {1, 3, 2, 2})
                                               .Weights("flat", std::vector<int64_t>{-1})
                                               .Weights("zero", std::vector<float>{0})
                                               .Node("Reshape", {"x", "flat"}, "values")
                                               .Node("Greater", {"values", "zero"}, "positive")
                                               .Node("Compress", {"values", "positive"}, "y")
                                               .Output("y", {-1})
                                               .Model();
  const auto model = OnnxModel::Load(path, {});
  ASSERT_TRUE(model.ok()) << model.error();
  EXPECT_EQ((*model)->dim(), 12);
  const cv::Mat black(4, 4, CV_8UC3, cv::Scalar(0, 0, 0));
  EXPECT_THROW((*model)->Describe({black, 1, nullptr}), std::runtime_error);
}

}  // namespace skein::onnx_network_runtime_test
