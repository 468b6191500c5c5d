// What the examples read of a session: its cameras and the table of its frames.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

struct Camera {
  std::string name;
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  Eigen::Isometry3d bMc = Eigen::Isometry3d::Identity();  // camera to arm base
};

/// The camera with a role: "mono", "left" or "right".
inline Camera read_camera(const std::string& session, const std::string& role) {
  for (const YAML::Node& node : YAML::LoadFile(session + "/session.yaml")["cameras"]) {
    if (node["role"].as<std::string>() != role) continue;
    Camera camera;
    const YAML::Node m = node["model"], pose = node["bMc"];
    const auto number = [&](const char* key) { return m[key].as<double>(); };
    camera.name = node["name"].as<std::string>();
    camera.width = m["width_px"].as<int>(), camera.height = m["height_px"].as<int>();
    camera.fx = number("fx_px"), camera.fy = number("fy_px"), camera.cx = number("cx_px"), camera.cy = number("cy_px");
    camera.k1 = number("k1"), camera.k2 = number("k2"), camera.p1 = number("p1"), camera.p2 = number("p2");
    camera.k3 = number("k3");
    const auto t = pose["translation_m"].as<std::vector<double>>();
    const auto q = pose["quaternion_xyzw"].as<std::vector<double>>();
    camera.bMc.translation() = Eigen::Vector3d(t.at(0), t.at(1), t.at(2));
    camera.bMc.linear() = Eigen::Quaterniond(q.at(3), q.at(0), q.at(1), q.at(2)).normalized().toRotationMatrix();
    return camera;
  }
  throw std::runtime_error("session.yaml: no camera with the role " + role);
}

/// A row of frames.csv by its columns' names.
using FrameRow = std::map<std::string, std::string>;

/// The rows of one camera with the laser on, or off.
inline std::vector<FrameRow> read_frames(const std::string& session, const std::string& camera, bool laser_on) {
  std::ifstream table(session + "/frames.csv");
  std::string line, cell;
  std::vector<std::string> columns;
  std::getline(table, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) columns.push_back(cell);
  std::vector<FrameRow> rows;
  while (std::getline(table, line)) {
    FrameRow row;
    std::istringstream cells(line);
    for (const std::string& column : columns) std::getline(cells, row[column], ',');
    if (row.at("camera") == camera && row.at("laser_on") == (laser_on ? "1" : "0")) rows.push_back(std::move(row));
  }
  if (rows.empty())
    throw std::runtime_error("no pictures of " + camera + " with the laser " + (laser_on ? "on" : "off"));
  return rows;
}

inline double number(const FrameRow& row, const std::string& column) {
  std::istringstream text(row.at(column));
  double value = 0;
  if (!(text >> value)) throw std::runtime_error("frames.csv: " + column + ": expected a number");
  return value;
}
