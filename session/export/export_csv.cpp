#include "session/export/export_csv.hpp"

#include <fmt/format.h>

#include <concepts>

#include "core/csv.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

/// One line of a table.
class Line {
 public:
  Line& add(std::string_view field) {
    text_ += (text_.empty() ? "" : ",");
    text_ += field;
    return *this;
  }
  Line& add(double value) { return add(exact_text(value)); }
  Line& add(std::integral auto value) { return add(fmt::to_string(value)); }
  Line& time(Stamp stamp, Stamp start, const WallClock& clock) {
    return add(fmt::format("{:.9f}", seconds(stamp - start))).add(clock.at(stamp));
  }
  Line& joints(const char* before, const char* after) {
    for (const char* joint : kJointNames) add(std::string(before) + joint + after);
    return *this;
  }
  Line& joints(const JointVector& q) {
    for (const double value : q) add(value);
    return *this;
  }
  Line& empty(int fields) {
    for (int i = 0; i < fields; ++i) text_ += ',';
    return *this;
  }
  std::string str() const { return text_ + '\n'; }

 private:
  std::string text_;
};

}  // namespace

std::string flat_joints_csv(const std::vector<JointState>& joints, Stamp start, const WallClock& clock) {
  Line header;
  header.add("time_s").add("wall_ns").joints("q_", "_rad").joints("velocity_", "_rad_s").joints("", "_ticks");
  std::string out = header.add("current_a").str();
  for (const JointState& state : joints) {
    Line line;
    line.time(state.stamp, start, clock).joints(state.q).joints(state.velocity);
    for (const std::int32_t ticks : state.ticks) line.add(ticks);
    out += line.add(state.current_a).str();
  }
  return out;
}

std::string flat_frames_csv(const Session& session, Stamp start, const WallClock& clock) {
  Line header;
  for (const char* name :
       {"camera", "index", "sequence", "time_s", "wall_ns", "exposure_s", "phase", "pass", "laser_on"})
    header.add(name);
  header.joints("q_", "_rad").add("sync_residual_s").add("stamp_sigma_s");
  for (const char* name : {"bMe_x_m", "bMe_y_m", "bMe_z_m", "bMe_qx", "bMe_qy", "bMe_qz", "bMe_qw", "file"})
    header.add(name);
  std::string out = header.str();
  for (const FrameRecord& frame : session.frames) {
    Line line;
    line.add(csv_field(frame.camera)).add(frame.index).add(frame.sequence);
    line.time(frame.stamp, start, clock).add(seconds(frame.exposure)).add(to_string(frame.phase));
    line.add(frame.pass).add(frame.laser_on ? "1" : "0");
    if (frame.q)
      line.joints(*frame.q);
    else
      line.empty(kJoints);
    line.add(seconds(frame.sync_residual)).add(seconds(frame.stamp_sigma));
    if (frame.q && session.info.calibration.arm) {
      const Transform bMe = session.info.calibration.arm->bMe(*frame.q);
      for (const double value : Vector3d(bMe.translation())) line.add(value);
      for (const double value : quaternion_xyzw(bMe)) line.add(value);
    } else {
      line.empty(7);
    }
    out += line.add(csv_field(frame.file)).str();
  }
  return out;
}

std::string flat_events_csv(const std::vector<SessionEvent>& events, Stamp start, const WallClock& clock) {
  std::string out = "time_s,wall_ns,kind,text\n";
  for (const SessionEvent& event : events)
    out += Line().time(event.stamp, start, clock).add(csv_field(event.kind)).add(csv_field(event.text)).str();
  return out;
}

}  // namespace tankrig
