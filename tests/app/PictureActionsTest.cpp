#include "curlew/image/ImageFile.h"
#include "support/Command.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("panels takes the newest images, colours them and puts labels above", "[app][command]") {
    const Folder folder;
    const std::string make = "-noise dim=2 -slice width=200 -noise dim=2 seed=1 -slice width=200 ";
    folder.mustRun(make + "-panels gap=0 legend=0 -write p.png");
    const Image sheet = readPng(folder / "p.png");
    CHECK((sheet.width == 400 && sheet.height == 200));

    // The older one is at the left, and each has a scale of its own unless all are to have the same.
    folder.mustRun("-noise dim=2 -slice width=200 -write legend=0 a.png");
    const Image alone = readPng(folder / "a.png");
    bool same = true;
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x) same = same && alone.at(x, y) == sheet.at(x, y);
    CHECK(same);
    folder.mustRun(
        "-noise dim=2 -slice width=200 -noise dim=2 amplitude=9 -slice width=200 -panels gap=0 legend=0 "
        "scale=common -write c.png");
    CHECK_FALSE(readPng(folder / "c.png").at(100, 100) == alone.at(100, 100));

    folder.mustRun(make + "-panels columns=1 'labels=a|b' -write l.png -panels -write l2.png");
    CHECK(readPng(folder / "l.png").height > 2 * 200);
    // The two images are gone, unless they are kept.
    CHECK(readPng(folder / "l2.png").width < 300);
    folder.mustRun(make + "-panels keep=1 gap=0 -panels gap=0 -write k.png");
    CHECK(readPng(folder / "k.png").width == 200 + 200 + 400);

    folder.mustFail("-panels", {"panels", "no image"});
    folder.mustFail(make + "-panels count=3", {"there are 2"});
    folder.mustFail(make + "-panels 'labels=a|b|c'", {"3 labels for 2"});
}
