#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/report/csv.hpp"
#include "app/report/session.hpp"

/// How read_session() reads the files that have lines of figures. What is missing, torn or out of
/// order is a sentence in Session::missing.
namespace vergence::app::report {

/// What a file says, or a sentence in `missing`. `consequence`: what the page lacks without it.
[[nodiscard]] std::optional<std::string> read_part(const std::filesystem::path& file,
                                                   std::size_t limit, const char* consequence,
                                                   Session* session);
/// The same for a file that is read line by line.
[[nodiscard]] std::optional<FileLines> open_part(const std::filesystem::path& file,
                                                 const char* consequence, Session* session);
/// A sentence for each kind of damage of a file that is not zero. `lines`: as far as it was read.
void report_damage(const char* file, const FileLines& lines, std::size_t rows,
                   std::size_t disordered, Session* session);
/// The rest of a file is not read.
void leave_out(const char* file, std::size_t most, Session* session);

/// poses.csv, so many frames of it. False: it is missing, or has no head that names its columns.
[[nodiscard]] bool read_poses(const std::filesystem::path& folder, std::size_t most,
                              Session* session);
/// Frames with a pose and nothing else, of trajectory.tum.
void frames_from_trajectory(const std::filesystem::path& folder, std::size_t most,
                            Session* session);
/// The file of this name in TUM's format.
[[nodiscard]] std::vector<StampedPose> read_trajectory_part(const std::filesystem::path& folder,
                                                            const char* name,
                                                            const char* consequence,
                                                            std::size_t most, Session* session);
/// calibrations.csv.
void read_calibrations(const std::filesystem::path& folder, Session* session);
/// residuals.csv. Sessions that ended without matches, were cut off or are older have none.
void read_residuals(const std::filesystem::path& folder, Session* session);

}  // namespace vergence::app::report
