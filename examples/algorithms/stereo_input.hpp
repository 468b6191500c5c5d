// What the stereo examples read of a session: the two cameras and their pictures with the laser off.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

struct StereoInput {
  struct Eye {
    std::string name;
    int width = 0, height = 0;
    double fx = 0, fy = 0, cx = 0, cy = 0;
    double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
    Eigen::Isometry3d bMc = Eigen::Isometry3d::Identity();  // camera to arm base
    std::vector<std::string> pictures;
  };
  Eye left, right;
};

inline StereoInput read_stereo(const std::string& session) {
  StereoInput input;
  for (const YAML::Node& camera : YAML::LoadFile(session + "/session.yaml")["cameras"]) {
    const auto role = camera["role"].as<std::string>();
    if (role != "left" && role != "right") continue;
    StereoInput::Eye& eye = role == "left" ? input.left : input.right;
    const YAML::Node m = camera["model"], pose = camera["bMc"];
    const auto number = [&](const char* key) { return m[key].as<double>(); };
    eye.name = camera["name"].as<std::string>();
    eye.width = m["width_px"].as<int>(), eye.height = m["height_px"].as<int>();
    eye.fx = number("fx_px"), eye.fy = number("fy_px"), eye.cx = number("cx_px"), eye.cy = number("cy_px");
    eye.k1 = number("k1"), eye.k2 = number("k2"), eye.p1 = number("p1"), eye.p2 = number("p2"), eye.k3 = number("k3");
    const auto t = pose["translation_m"].as<std::vector<double>>();
    const auto q = pose["quaternion_xyzw"].as<std::vector<double>>();
    eye.bMc.translation() = Eigen::Vector3d(t.at(0), t.at(1), t.at(2));
    eye.bMc.linear() = Eigen::Quaterniond(q.at(3), q.at(0), q.at(1), q.at(2)).normalized().toRotationMatrix();
  }
  std::ifstream table(session + "/frames.csv");
  std::string line, cell;
  std::getline(table, line);
  std::vector<std::string> header;
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) header.push_back(cell);
  const auto column = [&](const char* name) {
    for (std::size_t i = 0; i < header.size(); ++i)
      if (header[i] == name) return i;
    throw std::runtime_error("frames.csv: no column " + std::string(name));
  };
  const std::size_t camera = column("camera"), laser = column("laser_on"), file = column("file");
  while (std::getline(table, line)) {
    std::vector<std::string> cells;
    for (std::istringstream row(line); std::getline(row, cell, ',');) cells.push_back(cell);
    if (cells.at(laser) != "0") continue;
    for (StereoInput::Eye* eye : {&input.left, &input.right})
      if (cells.at(camera) == eye->name) eye->pictures.push_back(session + "/" + cells.at(file));
  }
  if (input.left.pictures.empty() || input.right.pictures.empty())
    throw std::runtime_error("no pictures of both eyes with the laser off");
  return input;
}

/// Binary PLY of float32 x y z, in the arm's base b.
inline void write_ply(const std::string& file, const std::vector<Eigen::Vector3f>& points) {
  std::ofstream out(file, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\ncomment frame b\nelement vertex " << points.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (const Eigen::Vector3f& p : points) out.write(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
  if (!out.flush()) throw std::runtime_error(file + ": cannot be written");
}
