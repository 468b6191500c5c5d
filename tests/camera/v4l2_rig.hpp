// A V4L2 camera on a scripted device, for tests.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/input_error.hpp"
#include "drivers/camera/v4l2_camera.hpp"
#include "tests/camera/v4l2_scripted_device.hpp"

namespace tankrig {

class V4l2Rig : public ::testing::Test {
 protected:
  std::shared_ptr<V4l2Script> script = std::make_shared<V4l2Script>();
  V4l2CameraSettings settings = [] {
    V4l2CameraSettings s;
    s.name = "mono";
    s.device = "/dev/video7";
    s.channels = 1;
    s.exposure = std::chrono::milliseconds{10};
    return s;
  }();

  std::unique_ptr<V4l2Camera> open() {
    return std::make_unique<V4l2Camera>(settings, std::make_unique<ScriptedV4l2Device>(script));
  }
  std::unique_ptr<V4l2Camera> started() {
    auto camera = open();
    EXPECT_TRUE(camera->start().ok());
    return camera;
  }
  /// What opening says; "" if it works.
  std::string refusal() {
    try {
      open();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  static std::optional<Frame> grab(V4l2Camera& camera) {
    auto news = camera.try_grab();
    EXPECT_TRUE(news.ok()) << (news.ok() ? "" : news.error().where);
    return news.ok() ? std::move(news.value()) : std::nullopt;
  }
  static ErrorCode error_of(V4l2Camera& camera) {
    const auto news = camera.try_grab();
    EXPECT_FALSE(news.ok());
    return news.ok() ? ErrorCode::kInternal : news.error().code;
  }
  static double statistic(const V4l2Camera& camera, const std::string& name) {
    for (const Statistic& one : camera.statistics())
      if (one.name == name) return one.value;
    ADD_FAILURE() << "no statistic " << name;
    return -1;
  }
  static int pixel(const Frame& frame, int x = 0, int y = 0) { return frame.image.at<std::uint8_t>(y, x); }
};

}  // namespace tankrig
