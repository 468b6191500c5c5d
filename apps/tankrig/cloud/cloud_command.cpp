#include "apps/tankrig/cloud/cloud_command.hpp"

#include "apps/tankrig/commands.hpp"
#include "pipeline/reconstruct_session.hpp"
#include "reconstruction/pointcloud/cloud_filters.hpp"
#include "reconstruction/pointcloud/floor.hpp"
#include "reconstruction/pointcloud/normals.hpp"

namespace tankrig::app {
namespace {

CLI::Option* add_vector(CLI::App* c, const std::string& name, std::vector<double>& value, const std::string& what) {
  return c->add_option(name, value, what)->delimiter(',')->expected(3)->type_name("X,Y,Z");
}

template <class Options>
Options& add_operation(CLI::App& parent, ChosenCommand& chosen, int (*run)(const Options&), const char* name,
                       const char* what, const char* example, CLI::App*& c, bool out_required = true) {
  c = parent.add_subcommand(name, what);
  Options& o = options_of(c, chosen, run);
  c->footer(std::string("Example: tankrig cloud ") + example);
  c->add_option("cloud", o.cloud, "Cloud, .ply or .pcd, metres")->required();
  CLI::Option* out = c->add_option("--out", o.out, "File to write, which must not exist");
  if (out_required) out->required();
  add_json_flag(c, o.json);
  return o;
}

void add_ascii(CLI::App* c, bool& ascii) { c->add_flag("--ascii", ascii, "Write text instead of binary"); }

void add_up(CLI::App* c, std::vector<double>& up) {
  add_vector(c, "--up", up, "Up in the cloud's frame (default: known for frames b, o and w)");
}

void add_normal_options(CLI::App* c, NormalOptions& o) {
  o.radius_m = kNormalRadius;
  c->add_option("--radius", o.radius_m, "Neighbours within this distance make a point's normal [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_vector(c, "--seen-from", o.seen_from,
             "Where the camera stood, in the cloud's frame: normals are on its side (default in frame c: the origin)");
}

void add_merge(CLI::App& cloud, ChosenCommand& chosen) {
  CLI::App* c = cloud.add_subcommand("merge", "Bring clouds or sessions together between which the object was turned");
  CloudMergeOptions& o = options_of(c, chosen, &cloud_merge);
  c->footer(
      "Sessions begin where their rig files put the object (bMo), clouds at every turn about up. The floor is left "
      "out.\n"
      "Refused (exit code 1) where overlap or shape leaves the fit open; then --object may help.\n"
      "Example: tankrig cloud merge sessions/a sessions/a-turned --object etc/objects/black_box.obj --out whole.ply");
  c->add_option("inputs", o.inputs, "Two or more sessions, or clouds with normals")->required();
  c->add_option("--out", o.out, "Cloud to write, .ply or .pcd, which must not exist")->required();
  c->add_option("--object", o.object, "Register each to this triangle mesh instead of to those before it; metres");
  c->add_option("--method", o.method, "Which cloud of the sessions")
      ->check(CLI::IsMember(tankrig::kMethods))
      ->capture_default_str();
  add_up(c, o.up);
  c->add_option("--least-overlap", o.least_share, "Share of each cloud's points that must find a partner")
      ->check(CLI::Range(0.05, 1.0))
      ->capture_default_str();
  c->add_flag("--search", o.search, "Try every turn about up for sessions too: their rig files do not know it");
  add_ascii(c, o.ascii);
  add_json_flag(c, o.json);
}

}  // namespace

void add_cloud(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* cloud = app.add_subcommand("cloud", "Convert, clean, align, merge and mesh point clouds");
  cloud->require_subcommand(1);
  cloud->footer("Example: tankrig cloud voxel sessions/monday/clouds/laser.ply --edge 0.005 --out small.ply");
  CLI::App* c = nullptr;

  auto& convert = add_operation(*cloud, chosen, &cloud_convert, "convert", "Write a cloud as PLY or PCD, by extension",
                                "convert scanner.pcd --millimetres --frame o --out object.ply", c);
  c->add_flag("--millimetres", convert.millimetres, "The file's coordinates are millimetres");
  CLI::Option* frame =
      c->add_option("--frame", convert.frame, "Letter of the new cloud's frame, docs/reference/clouds.md")
          ->check(CLI::IsMember({"w", "b", "e", "c", "r", "l", "o", "g"}));
  c->add_option("--pose", convert.pose, "YAML with translation_m and quaternion_xyzw of the file's frame in --frame")
      ->needs(frame);
  add_ascii(c, convert.ascii);

  auto& crop = add_operation(*cloud, chosen, &cloud_crop, "crop", "Keep the points inside of a box",
                             "crop laser.ply --min -0.5,-0.3,0.9 --max 0,0.3,1.17 --out box.ply", c);
  add_vector(c, "--min", crop.min, "Its lowest corner in the cloud's frame [m]")->required();
  add_vector(c, "--max", crop.max, "Its highest corner [m]")->required();
  c->add_flag("--outside", crop.outside, "Keep what is outside instead");
  add_ascii(c, crop.ascii);

  auto& voxel = add_operation(*cloud, chosen, &cloud_voxel, "voxel", "One mean point for each cube of a grid",
                              "voxel laser.ply --edge 0.005 --out small.ply", c);
  c->add_option("--edge", voxel.edge_m, "Edge of the cubes [m]")->check(CLI::PositiveNumber)->capture_default_str();
  add_ascii(c, voxel.ascii);

  auto& normals = add_operation(*cloud, chosen, &cloud_normals, "normals", "Give every point the surface's normal",
                                "normals laser.ply --seen-from 0.716,0.228,0.585 --out oriented.ply", c);
  add_normal_options(c, normals);
  add_ascii(c, normals.ascii);

  auto& outliers = add_operation(*cloud, chosen, &cloud_outliers, "outliers", "Take lonely points out",
                                 "outliers stereo.ply --sigmas 2 --out clean.ply", c);
  const OutlierFilter filter;
  outliers.neighbours = filter.neighbours;
  outliers.sigmas = filter.sigmas;
  c->add_option("--neighbours", outliers.neighbours, "How many neighbours' mean distance counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  c->add_option("--sigmas", outliers.sigmas, "How far above the cloud's mean distance a point's may be")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_ascii(c, outliers.ascii);

  auto& floor =
      add_operation(*cloud, chosen, &cloud_floor, "floor", "Find the floor; with --out, write the cloud without it",
                    "floor laser.ply --out object.ply", c, false);
  floor.band_m = FloorSettings{}.band_m;
  add_up(c, floor.up);
  c->add_option("--band", floor.band_m, "How far from its plane a floor point may be [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_ascii(c, floor.ascii);

  auto& align = add_operation(
      *cloud, chosen, &cloud_align, "align", "Lay a cloud on a mesh or on another cloud",
      "align laser.ply --object etc/objects/black_box.obj --pose pose.yaml --pose-out found.yaml", c, false);
  auto* target = c->add_option_group("target");
  target->add_option("--object", align.object, "Triangle mesh, metres");
  target->add_option("--to", align.to, "Cloud with normals");
  target->require_option(1);
  c->add_option("--pose", align.pose,
                "YAML: about where the mesh's (or other cloud's) frame is in the cloud's (default: the same frame, or "
                "every turn about up)");
  c->add_option("--pose-out", align.pose_out, "Write the pose found, for `evaluate --pose`");
  add_up(c, align.up);
  add_ascii(c, align.ascii);

  auto& mesh = add_operation(*cloud, chosen, &cloud_mesh, "mesh", "Make a triangle mesh: .stl, .obj or .ply",
                             "mesh oriented.ply --method poisson --out object.stl", c);
  c->add_option("--method", mesh.method, "poisson: smooth; greedy: the points themselves, joined")
      ->check(CLI::IsMember({"poisson", "greedy"}))
      ->capture_default_str();
  c->add_option("--depth", mesh.depth, "Poisson's octree: one more halves its cells")
      ->check(CLI::Range(3, 12))
      ->capture_default_str();
  c->add_option("--trim", mesh.trim_m, "Take Poisson's guesses off that are farther from every point [m]; 0: keep them")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  c->add_option("--edge", mesh.edge_m, "Greedy: longest edge [m]")->check(CLI::PositiveNumber)->capture_default_str();
  add_normal_options(c, mesh);

  add_merge(*cloud, chosen);
}

}  // namespace tankrig::app
