#include "features/onnx_descriptor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "features/model_choice.h"
#include "testing/test_folder.h"
#include "testing/test_onnx.h"

namespace skein::onnx_descriptor_test {

// A model of one node from x to y.
std::string OneNodeModel(const std::string& op, const std::vector<int64_t>& in,
                         const std::vector<int64_t>& out) {
  return TestOnnx(11).Input("x", in).Node(op, {"x"}, "y").Output("y", out).Model();
}

// y = flatten(global average of the input): the mean of each channel. `op` names the pooling.
TestOnnx MeanColour(const std::string& op, int height, int width) {
  return TestOnnx(11)
      .Input("x", {1, 3, height, width})
      .Node(op, {"x"}, "pooled")
      .Node("Flatten", {"pooled"}, "y", TestOnnx::Attribute("axis", 1))
      .Output("y", {1, 3});
}
std::string MeanColourModel(const std::string& op = "GlobalAveragePool", int height = 4,
                            int width = 6) {
  return MeanColour(op, height, width).Model();
}

class OnnxDescriptor : public testing::Test {
 protected:
  OnnxDescriptor() {
    options_.width_px = 6;
    options_.height_px = 4;
    options_.mean = {0.5, 0.25, 0};
    options_.std = {0.5, 1, 2};
  }

  std::string Write(const std::string& name, const std::string& contents) {
    const std::string path = folder_ / name;
    std::ofstream(path, std::ios::binary) << contents;
    return path;
  }

  TestFolder folder_;
  OnnxOptions options_;
};

TEST_F(OnnxDescriptor, IsTheModelsOutputOfUnitLength) {
  const auto model = OnnxModel::Load(Write("m.onnx", MeanColourModel()), options_);
  ASSERT_TRUE(model.ok()) << model.error();
  EXPECT_EQ((*model)->dim(), 3);
  const cv::Mat photo(40, 60, CV_8UC3, cv::Scalar(51, 102, 204));  // blue, green, red
  const auto values = (*model)->Describe({photo, 1, nullptr});
  const double r = (0.8 - 0.5) / 0.5;
  const double g = (0.4 - 0.25) / 1;
  const double b = 0.2 / 2;
  const double norm = std::sqrt(r * r + g * g + b * b);
  ASSERT_EQ(values.size(), 3u);
  EXPECT_NEAR(values[0], r / norm, 1e-5);
  EXPECT_NEAR(values[1], g / norm, 1e-5);
  EXPECT_NEAR(values[2], b / norm, 1e-5);
}

TEST_F(OnnxDescriptor, TakesChannelsInTheOrderAskedFor) {
  options_.mean = {0, 0, 0};
  options_.std = {1, 1, 1};
  const std::string path = Write("m.onnx", MeanColourModel());
  const cv::Mat photo(40, 60, CV_8UC3, cv::Scalar(255, 0, 0));
  EXPECT_NEAR((*OnnxModel::Load(path, options_))->Describe({photo, 1, nullptr})[2], 1, 1e-5);
  options_.channel_order = "BGR";
  EXPECT_NEAR((*OnnxModel::Load(path, options_))->Describe({photo, 1, nullptr})[0], 1, 1e-5);
}

TEST_F(OnnxDescriptor, IdChangesWithModelAndPreprocessing) {
  const std::string path = Write("m.onnx", MeanColourModel());
  const std::string max_path = Write("max.onnx", MeanColourModel("GlobalMaxPool"));
  const std::string id = (*OnnxModel::Load(path, options_))->id();
  EXPECT_EQ((*OnnxModel::Load(path, options_))->id(), id);
  EXPECT_NE((*OnnxModel::Load(max_path, options_))->id(), id);
  options_.mean[0] = 0.4;
  EXPECT_NE((*OnnxModel::Load(path, options_))->id(), id);
}

TEST_F(OnnxDescriptor, IsTheSameBitForBitInEachProcess) {
  const std::string path = Write("m.onnx", MeanColourModel());
  cv::Mat photo(40, 60, CV_8UC3);
  cv::randu(photo, 0, 256);
  const auto values = (*OnnxModel::Load(path, options_))->Describe({photo, 1, nullptr});
  ASSERT_EQ(values.size(), 3u);
  const auto again = OnnxModel::Load(path, options_);
  EXPECT_EQ((*again)->Describe({photo, 1, nullptr}), values);
  EXPECT_EQ((*again)->Describe({photo, 1, nullptr}), values);
}

TEST_F(OnnxDescriptor, IsEmptyOfAPhotoWithoutAnything) {
  options_.mean = {0, 0, 0};
  const auto model = OnnxModel::Load(Write("m.onnx", MeanColourModel()), options_);
  ASSERT_TRUE(model.ok()) << model.error();
  const cv::Mat black(40, 60, CV_8UC3, cv::Scalar(0, 0, 0));
  EXPECT_TRUE((*model)->Describe({black, 1, nullptr}).empty());
}

// As exporters before IR version 4 did.
TEST_F(OnnxDescriptor, WeightsAreNoInputs) {
  const std::string contents = MeanColour("GlobalAveragePool", 4, 6)
                                   .Input("unused", {2})
                                   .Weights("unused", std::vector<float>{1, 2})
                                   .Model();
  const auto model = OnnxModel::Load(Write("m.onnx", contents), options_);
  EXPECT_TRUE(model.ok()) << model.error();
}

TEST_F(OnnxDescriptor, WhatCannotBeRunSaysWhy) {
  EXPECT_FALSE(OnnxModel::Load((folder_ / "absent.onnx").string(), options_).ok());
  const auto text = OnnxModel::Load(Write("t.onnx", "no model"), options_);
  EXPECT_NE(text.error().find("t.onnx is no ONNX model"), std::string::npos) << text.error();
  const auto unknown = OnnxModel::Load(Write("u.onnx", MeanColourModel("NoSuchLayer")), options_);
  EXPECT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().find("u.onnx cannot be run by"), std::string::npos) << unknown.error();
  EXPECT_NE(unknown.error().find("; export it with"), std::string::npos) << unknown.error();
}

TEST_F(OnnxDescriptor, TakesItsSizeFromTheModel) {
  options_.width_px = options_.height_px = 0;
  const auto model = OnnxModel::Load(Write("m.onnx", MeanColourModel()), options_);
  ASSERT_TRUE(model.ok()) << model.error();
  EXPECT_EQ((*model)->dim(), 3);
  options_.width_px = 7;
  const auto other = OnnxModel::Load((folder_ / "m.onnx").string(), options_);
  EXPECT_NE(other.error().find("m.onnx takes a width of 6, not 7"), std::string::npos)
      << other.error();
}

TEST_F(OnnxDescriptor, AsksForASizeThatTheModelLeavesOpen) {
  const std::string path = Write("open.onnx", MeanColourModel("GlobalAveragePool", -1, -1));
  EXPECT_TRUE(OnnxModel::Load(path, options_).ok()) << OnnxModel::Load(path, options_).error();
  options_.width_px = 0;
  const std::string error = OnnxModel::Load(path, options_).error();
  EXPECT_NE(error.find("leaves its input width open: give --global-width"), std::string::npos)
      << error;
}

TEST_F(OnnxDescriptor, RefusesWhatIsNoVector) {
  const std::string error =
      OnnxModel::Load(Write("map.onnx", OneNodeModel("Relu", {1, 3, 4, 6}, {1, 3, 4, 6})), options_)
          .error();
  EXPECT_NE(error.find("map.onnx puts out 1 x 3 x 4 x 6"), std::string::npos) << error;
  EXPECT_NE(error.find("--global-output"), std::string::npos) << error;
}

TEST_F(OnnxDescriptor, RefusesAnInputThatIsNoPhoto) {
  const std::string error =
      OnnxModel::Load(Write("last.onnx", OneNodeModel("Relu", {1, 4, 6, 3}, {1, 4, 6, 3})),
                      options_)
          .error();
  EXPECT_NE(error.find("takes 1 x 4 x 6 x 3, not one photo"), std::string::npos) << error;
}

TEST_F(OnnxDescriptor, RefusesMeansOf255) {
  const std::string path = Write("m.onnx", MeanColourModel());
  options_.mean[1] = 116.28;
  EXPECT_EQ(OnnxModel::Load(path, options_).error(),
            "the mean 116.28 is not of pixel / 255: divide it by 255");
  options_.mean[1] = 0.456;
  options_.std[2] = 57.4;
  EXPECT_NE(OnnxModel::Load(path, options_).error().find("57.4"), std::string::npos);
}

TEST_F(OnnxDescriptor, KnowsAGitLfsPointer) {
  const std::string error =
      OnnxModel::Load(Write("lfs.onnx", "version https://git-lfs/spec/v1\noid sha256:00\nsize 9\n"),
                      options_)
          .error();
  EXPECT_NE(error.find("lfs.onnx is a Git LFS pointer"), std::string::npos) << error;
}

TEST_F(OnnxDescriptor, SaysWhichOutputsThereAre) {
  options_.output = "z";
  const std::string error = OnnxModel::Load(Write("m.onnx", MeanColourModel()), options_).error();
  EXPECT_NE(error.find("m.onnx has no output \"z\"; there are: y (1 x 3)"), std::string::npos)
      << error;
}

TEST_F(OnnxDescriptor, ReadsTheJsonBesideTheModel) {
  ModelChoice choice;
  choice.onnx_path = Write("m.onnx", MeanColourModel());
  Write("m.json", R"({"width": 6, "height": 4, "mean": [0, 0, 0], "std": [1, 1, 1],
                      "channel_order": "BGR", "output": "y"})");
  const auto model = LoadModel(choice);
  const cv::Mat photo(40, 60, CV_8UC3, cv::Scalar(255, 0, 0));
  EXPECT_NEAR(model->Describe({photo, 1, nullptr})[0], 1, 1e-5);
  Write("m.json", R"({"widht": 6})");
  EXPECT_THROW(LoadModel(choice), std::invalid_argument);
}

}  // namespace skein::onnx_descriptor_test
