#include "app/devices/inventory.hpp"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/unit/app/devices/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::FakeMachine;

TEST(Machine, numbersAreReadAndOtherTextIsNone) {
  const FakeMachine f;
  f.file("/sys/good", "  42\n");
  f.file("/sys/negative", "-1\n");
  f.file("/sys/hex", "1e10\n");
  f.file("/sys/words", "42 apples\n");
  f.file("/sys/empty", "");
  f.file("/sys/huge", "99999999999999999999999\n");
  f.file("/sys/binary", std::string("\0\x01\xff\n42", 6));
  EXPECT_EQ(f.machine.number("/sys/good"), 42);
  EXPECT_EQ(f.machine.number("/sys/negative"), -1);
  EXPECT_EQ(f.machine.number("/sys/hex", 16), 0x1E10);
  for (const char* name :
       {"/sys/words", "/sys/empty", "/sys/huge", "/sys/binary", "/sys/missing", "/sys"})
    EXPECT_FALSE(f.machine.number(name)) << name;
}

TEST(Machine, limitsAndCapabilitiesAreRead) {
  const FakeMachine f;
  f.file("/proc/self/status", "Name:\tx\nCapPrm:\t0000000000000000\nCapEff:\t0000000000003000\n");
  f.file("/proc/self/limits",
         "Limit                     Soft Limit           Hard Limit           Units\n"
         "Max locked memory         65536                unlimited            bytes\n"
         "Max realtime priority     unlimited            0\n"
         "Max nonsense              many                 0\n");
  EXPECT_TRUE(f.machine.has_capability(13));
  EXPECT_FALSE(f.machine.has_capability(14));
  EXPECT_FALSE(f.machine.has_capability(64));
  EXPECT_EQ(f.machine.limit("Max locked memory"), 65536);
  EXPECT_EQ(f.machine.limit("Max realtime priority"), -1);
  EXPECT_FALSE(f.machine.limit("Max nonsense"));
  EXPECT_FALSE(f.machine.limit("Max absent"));
}

TEST(Machine, roomBehindClosedFolderIsNotWritable) {
  const test::TemporaryFolder folder;
  (void)folder.write("closed/a/b/file", "");
  ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
  ASSERT_EQ(::chmod((folder / "closed").c_str(), 0), 0);
  // Root may enter any folder, so another user checks.
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && (::setgid(kNobody) != 0 || ::setuid(kNobody) != 0)) ::_exit(3);
    const auto room = Machine::here().room_at(folder / "closed/a/b/c");
    ::_exit(!room ? 2 : room->may_write ? 1 : 0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  (void)::chmod((folder / "closed").c_str(), 0700);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0) << "1: it may write; 2: unknown; 3: no other user here";
}

TEST(UsbDevices, devicesAreListedAndNonsenseIsSkipped) {
  const FakeMachine f;
  const auto usb = [&f](const std::string& port, const std::string& vendor) {
    const std::string at = "/sys/bus/usb/devices/" + port + "/";
    f.file(at + "idVendor", vendor + "\n");
    f.file(at + "idProduct", "2005\n");
    return at;
  };
  const std::string camera = usb("1-2", "1e10");
  f.file(camera + "serial", "12345\n");
  f.file(camera + "busnum", "1\n");
  f.file(camera + "devnum", "2\n");
  f.file(camera + "manufacturer", "Point Grey\n");
  f.file(camera + "product", "Chameleon\n");
  f.file(camera + "1-2:1.0/video4linux/video0/index", "0\n");
  f.file(camera + "1-2:1.2/video4linux/video2/index", "0\n");
  f.file(usb("1-3", "046d") + "devnum", "-7\n");
  f.file("/sys/bus/usb/devices/1-3:1.0/video4linux", "not a folder");
  (void)usb("usb1", "1d6b");
  (void)usb("1-4", "zzzz");
  (void)usb("1-6", "11e10");
  f.file("/sys/bus/usb/devices/1-5/idVendor", "1e10\n");
  const auto all = list_usb_devices(f.machine);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].title, "Point Grey Chameleon");
  EXPECT_EQ(all[0].serial, "12345");
  EXPECT_EQ(all[0].node(), "/dev/bus/usb/001/002");
  EXPECT_EQ(all[0].video, (std::vector<std::string>{"video0", "video2"}));
  EXPECT_EQ(all[1].number, 0);
}

TEST(SerialPorts, portIsNamedByNodeLinkOrSerial) {
  const FakeMachine f;
  f.file("/dev/ttyUSB0", "");
  std::filesystem::create_symlink("ttyUSB0", f.folder / "dev/imu");
  FoundPort p = test::port(0x0403, 0x6001, "A1");
  p.by_id = "/dev/serial/by-id/usb-FTDI_A1-if00-port0";
  for (const char* key : {"", "/dev/ttyUSB0", "ttyUSB0", "A1", "/dev/imu", p.by_id.c_str()})
    EXPECT_TRUE(names_port(f.machine, key, p)) << key;
  for (const char* key : {"/dev/ttyUSB1", "A", "/dev/vergence/ins-A2"})
    EXPECT_FALSE(names_port(f.machine, key, p)) << key;
  EXPECT_FALSE(names_port(f.machine, "", test::port(0, 0, "")));
}

}  // namespace
}  // namespace vergence::app
