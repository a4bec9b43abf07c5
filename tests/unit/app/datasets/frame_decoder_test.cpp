#include "app/datasets/frame_decoder.hpp"

#include <tuple>

#include <opencv2/core.hpp>

#include "tests/support/refusal.hpp"
#include "tests/unit/app/datasets/tiny_drive.hpp"

namespace vergence::app {
namespace {

class Decoder : public testing::Test {
 protected:
  void open(int pairs) {
    test::write_tiny_folder(folder_, pairs);
    reopen();
  }
  void reopen() { sequence_ = open_sequence(SequenceFormat::folder, folder_.path()); }

  struct Seen {
    DecodedPair pair;
    bool right_pixels = false;
  };
  /// All that comes, slots released as they are read.
  std::vector<Seen> drain(std::size_t first, std::size_t count) {
    FrameDecoder decoder(sequence_, first, count, pool_);
    std::vector<Seen> seen;
    for (DecodedPair pair; decoder.next(&pair);) {
      seen.push_back({pair, pair.decoded && pixels_are_right(pair)});
      decoder.release(pair);
    }
    return seen;
  }
  [[nodiscard]] bool pixels_are_right(const DecodedPair& pair) const {
    for (int k = 0; k < 2; ++k) {
      const ImageView image = pool_.view(pair.slots[static_cast<std::size_t>(k)]);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          if (image.at(x, y) !=
              test::tiny_pixel(x, y, test::tiny_seed(static_cast<int>(pair.frame), k)))
            return false;
    }
    return true;
  }

  test::TemporaryFolder folder_;
  StereoSequence sequence_;
  Arena arena_;
  FramePool pool_{test::kTinyWidth, test::kTinyHeight, FrameDecoder::kSlots, arena_};
};

TEST_F(Decoder, splitsSideBySideImages) {
  test::write_tiny_folder(folder_, 3);
  for (int i = 0; i < 3; ++i) {
    cv::Mat both;
    cv::hconcat(cv::imread((folder_ / test::folder_name(0, i)).string(), cv::IMREAD_GRAYSCALE),
                cv::imread((folder_ / test::folder_name(1, i)).string(), cv::IMREAD_GRAYSCALE),
                both);
    std::filesystem::create_directories(folder_ / "both");
    ASSERT_TRUE(cv::imwrite((folder_ / fmt::format("both/{:03d}.png", i)).string(), both));
  }
  for (const char* side : {"left", "right"}) std::filesystem::remove_all(folder_ / side);
  ASSERT_EQ(find_format(folder_.path()), SequenceFormat::folder);
  reopen();
  EXPECT_TRUE(sequence_.side_by_side);
  EXPECT_EQ(first_image_size(sequence_, 1), (ImageSize{test::kTinyWidth, test::kTinyHeight}));
  const auto seen = drain(0, 3);
  ASSERT_EQ(seen.size(), 3U);
  for (const Seen& s : seen) EXPECT_TRUE(s.right_pixels) << s.pair.frame << s.pair.issue.data();
  test::write_tiny_image(folder_ / "both/001.png", 0, test::kTinyWidth, test::kTinyHeight);
  EXPECT_STREQ(drain(0, 3)[1].pair.kind, "image_size") << "half of a pair";
}

TEST_F(Decoder, deliversMorePairsThanSlotsInOrder) {
  constexpr int kPairs = 60;
  open(kPairs);
  const auto seen = drain(0, kPairs);
  ASSERT_EQ(seen.size(), static_cast<std::size_t>(kPairs));
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_EQ(seen[i].pair.frame, i);
    EXPECT_EQ(seen[i].pair.stamp, sequence_.pairs[i].stamp);
    EXPECT_TRUE(seen[i].right_pixels) << i;
  }
  EXPECT_EQ(pool_.available(), FrameDecoder::kSlots);
}

TEST_F(Decoder, clipsRangeAtEnd) {
  open(5);
  const auto seen = drain(3, 100);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].pair.frame, 3U);
  EXPECT_TRUE(drain(5, 1).empty());
  EXPECT_TRUE(drain(99, 1).empty());
}

TEST_F(Decoder, badImagesSkipOnlyTheirFrame) {
  open(8);
  std::filesystem::remove(folder_ / "left/001.png");
  test::truncate_file(folder_ / "right/002.png", 0.5);
  folder_.write("left/003.png", "not a picture at all");
  folder_.write("right/004.png", "");
  test::write_tiny_image(folder_ / "left/005.png", 1, 64, 48);
  const auto seen = drain(0, 8);
  ASSERT_EQ(seen.size(), 8U);
  const std::vector<std::string> kinds = {"",
                                          "image_missing",
                                          "image_truncated",
                                          "image_unreadable",
                                          "image_truncated",
                                          "image_size",
                                          "",
                                          ""};
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(seen[i].pair.kind, kinds[i]) << i;
    EXPECT_EQ(seen[i].pair.decoded, kinds[i].empty()) << i;
    EXPECT_EQ(seen[i].right_pixels, kinds[i].empty()) << i;
  }
  EXPECT_TRUE(test::mentions(std::string(seen[1].pair.issue.data()), "left/001.png is missing"))
      << seen[1].pair.issue.data();
  EXPECT_TRUE(test::mentions(std::string(seen[2].pair.issue.data()), "right/002.png is truncated"))
      << seen[2].pair.issue.data();
}

TEST_F(Decoder, badStampSkipsOnlyItsFrame) {
  open(5);
  for (const auto& [times, skipped, kind] :
       {std::tuple{"0.1\n0.2\n0.3\n0.2\n0.4\n", 3U, "stamp_not_increasing"},
        std::tuple{"0.1\n1000.2\n0.3\n0.4\n0.5\n", 1U, "stamp_outlier"}}) {
    folder_.write("times.txt", times);
    reopen();
    const auto seen = drain(0, 5);
    ASSERT_EQ(seen.size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(seen[i].pair.decoded, i != skipped) << i;
    EXPECT_STREQ(seen[skipped].pair.kind, kind);
  }
}

TEST_F(Decoder, truncatesLongName) {
  open(1);
  sequence_.pairs[0].file[0] = "left/" + std::string(2000, 'x') + ".png";
  const auto seen = drain(0, 1);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(std::string(seen[0].pair.issue.data()).size(), seen[0].pair.issue.size() - 1);
}

TEST_F(Decoder, stopsWhileConsumerHoldsPairs) {
  open(40);
  for (const int taken : {0, 1, 10}) {
    Arena arena;
    FramePool pool(test::kTinyWidth, test::kTinyHeight, FrameDecoder::kSlots, arena);
    FrameDecoder decoder(sequence_, 0, 40, pool);
    DecodedPair pair;
    for (int i = 0; i < taken; ++i) {
      ASSERT_TRUE(decoder.next(&pair));
      decoder.release(pair);
    }
    // This case tests the destructor alone.
    if (taken == 0) continue;
    decoder.stop();
    EXPECT_FALSE(decoder.next(&pair));
  }
}

}  // namespace
}  // namespace vergence::app
