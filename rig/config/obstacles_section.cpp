#include "rig/config/obstacles_section.hpp"

#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kRadius{0, 1};

Vector3d read_size(const ConfigNode& node, const char* key) {
  const Vector3d size = read_vector(node, key);
  if (!(size.minCoeff() > 0)) node.fail(key, "found a side that is not positive, expected three lengths");
  return size;
}

/// `frame`: the letter of the frame its ends are in.
Capsule read_capsule(const ConfigNode& node, char frame) {
  const auto key = [&](const char* end) { return std::string(end) + "_" + frame + "_m"; };
  return {read_vector(node, key("from")), read_vector(node, key("to")), node.number("radius_m", kRadius)};
}

std::string read_name(const ConfigNode& node) {
  const std::string name = node.text("name");
  if (name.empty()) node.fail("name", "found nothing, expected what messages call this body");
  return shown_text(name);
}

void write_keys(YAML::Emitter& out, const Capsule& c, char frame) {
  out << YAML::Key << std::string("from_") + frame + "_m" << YAML::Value;
  emit_list(out, c.a);
  out << YAML::Key << std::string("to_") + frame + "_m" << YAML::Value;
  emit_list(out, c.b);
  out << YAML::Key << "radius_m" << YAML::Value << exact_text(c.radius);
}

void write_name(YAML::Emitter& out, const std::string& name) {
  out << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted << name;
}

void read_tank(const ConfigNode& node, const char* key, Obstacles& o) { o.tank_size = read_size(node, key); }
void write_tank(YAML::Emitter& out, const Obstacles& o) { emit_list(out, o.tank_size); }

void read_base(const ConfigNode& node, const char* key, Obstacles& o) { o.base = read_capsule(node.child(key), 'b'); }
void write_base(YAML::Emitter& out, const Obstacles& o) {
  out << YAML::Flow << YAML::BeginMap;
  write_keys(out, o.base, 'b');
  out << YAML::EndMap;
}

using Shapes = std::vector<Named<Shape>>;

/// `frame`: the letter of the frame they are in; `nameless`: what one without a name is called; empty: each has one.
Shapes read_shapes(const ConfigNode& node, const char* key, char frame, const std::string& nameless = "") {
  Shapes shapes;
  for (const ConfigNode& body : node.items(key)) {
    const std::string name = nameless.empty() || body.has("name") ? read_name(body) : nameless;
    if (body.has("size_m"))
      shapes.push_back({name, Box{body.transform(frame + std::string("Mbox")), read_size(body, "size_m")}});
    else
      shapes.push_back({name, read_capsule(body, frame)});
  }
  return shapes;
}
/// One body a line; none: [].
void write_shapes(YAML::Emitter& out, const Shapes& shapes, char frame) {
  out << (shapes.empty() ? YAML::Flow : YAML::Block) << YAML::BeginSeq;
  for (const auto& [name, shape] : shapes) {
    out << YAML::Flow << YAML::BeginMap;
    write_name(out, name);
    if (const Box* const box = std::get_if<Box>(&shape)) {
      out << YAML::Key << frame + std::string("Mbox") << YAML::Value;
      emit(out, box->xMbox);
      out << YAML::Key << "size_m" << YAML::Value;
      emit_list(out, box->size);
    } else {
      write_keys(out, std::get<Capsule>(shape), frame);
    }
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

void read_carried(const ConfigNode& node, const char* key, Obstacles& o) {
  o.carried = read_shapes(node, key, 'e', "projector");
}
void write_carried(YAML::Emitter& out, const Obstacles& o) { write_shapes(out, o.carried, 'e'); }

void read_fixed(const ConfigNode& node, const char* key, Obstacles& o) { o.fixed = read_shapes(node, key, 'b'); }
void write_fixed(YAML::Emitter& out, const Obstacles& o) { write_shapes(out, o.fixed, 'b'); }

const Setting<Obstacles> kObstacleRows[] = {
    {"tank_size_m", {read_tank, write_tank, "three lengths"}, "inside, along w's x and y, and height", Need::kRequired},
    {"wMb", &Obstacles::wMb, "where the arm's base is", Need::kRequired},
    {"margin_m", &Obstacles::margin, ConfigRange(0, 1), "a plan with less clearance is refused", Need::kRequired},
    {"link_radius_m", &Obstacles::link_radius, kRadius, "of every link of the arm, about its DH link", Need::kRequired},
    {"tool_length_m", &Obstacles::tool_length, ConfigRange(0, 2), "how far the forearm reaches beyond e"},
    {"base",
     {read_base, write_base, "`from_b_m`, `to_b_m`, `radius_m`"},
     "the arm's foot, a capsule; the forearm and what it carries keep away from it"},
    {"carried",
     {read_carried, write_carried,
      "list of `name` (or projector) and `from_e_m`, `to_e_m`, `radius_m` or `eMbox`, `size_m`"},
     "capsules and boxes rigid with the end effector"},
    {"fixed",
     {read_fixed, write_fixed, "list of `name` and `from_b_m`, `to_b_m`, `radius_m` or `bMbox`, `size_m`"},
     "capsules and boxes rigid with the base: the frame, mounts, lamps"},
};

}  // namespace

constinit const SettingsTable<Obstacles> kObstacleKeys{kObstacleRows};

}  // namespace tankrig
