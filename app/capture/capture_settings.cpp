#include "app/capture/capture_settings.hpp"

#include "drivers/sync/sync_types.hpp"

namespace vergence::app {

Configuration capture_configuration(const Configuration& configuration) {
  Configuration c = configuration;
  if (c.sync.mode != SyncMode::ins_syncout) c.ins.driver = "none";
  return c;
}

}  // namespace vergence::app
