// The commands of the program: one options struct and one function each, returning the exit code.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace tankrig::app {

enum ExitCode : int { kOk = 0, kFailure = 1, kUsage = 2, kPartial = 3 };

struct ScanOptions {
  std::string rig = "tank-sim";  ///< name below etc/rigs, or a path to a rig.yaml
  std::string preset;
  std::optional<double> light, noise, particles;
  std::optional<std::string> sensor;
  std::uint64_t seed = 1;
  std::string lux = "auto";  ///< "auto" reads the lux meter, or a value by hand
  std::string carrier;       ///< of the arm: "can" or "serial"; empty: the rig file's
  std::string operator_name, notes;
  std::filesystem::path faults;  ///< fault plan for simulated or emulated devices; empty: none
  std::filesystem::path out;     ///< session directory; empty: sessions/<rig>-<UTC>
  bool json = false, dry_run = false;
};
int scan(const ScanOptions& options);

struct ReconstructOptions {
  std::filesystem::path session;
  std::string method = "laser";
  std::filesystem::path rig;  ///< reconstruction parameters; empty: the session's own
  std::filesystem::path out;  ///< empty: SESSION/clouds/METHOD.ply
  bool json = false;
};
int reconstruct(const ReconstructOptions& options);

struct EvaluateOptions {
  std::filesystem::path cloud, object, pose;
  std::filesystem::path verdict;  ///< coloured cloud to write; empty: none
  std::string definition = "paper";
  std::optional<double> inlier_m, outlier_m, ground_m;
  std::string ground_plane;  ///< "a,b,c,d" in the object's frame; empty: horizontal, below the mesh
  bool json = false;
};
int evaluate(const EvaluateOptions& options);

struct ImportOptions {
  std::filesystem::path images, camera, planes, dark, out;
  std::string plane, notes;
  bool json = false;
};
int import_session(const ImportOptions& options);

struct SessionInfoOptions {
  std::filesystem::path session;
  bool json = false;
};
int session_info(const SessionInfoOptions& options);

struct SessionListOptions {
  std::filesystem::path folder = "sessions";
  std::string rig;  ///< of this one only; empty: of any
  bool json = false;
};
int session_list(const SessionListOptions& options);

struct ReportOptions {
  std::filesystem::path session;
  bool json = false;
};
int report(const ReportOptions& options);

struct InitOptions {
  std::filesystem::path directory;
  std::string from = "tank-sim";
  bool keys = false;  ///< print the keys of rig files and make nothing
};
int init(const InitOptions& options);

}  // namespace tankrig::app
