# The command line `build-fmu` in a container, without a compiler: docs/command_line.md, section Container.
#
#     docker build -t build-fmu .
#     docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" build-fmu import arm.urdf

FROM debian:bookworm-slim AS wheel
COPY . /source
WORKDIR /source
RUN sh scripts/setup.sh && sh scripts/sundials.sh && .venv/bin/python -m pip wheel --no-deps -w /wheel .

FROM debian:bookworm-slim
RUN apt-get update && apt-get install -y --no-install-recommends python3-venv && rm -rf /var/lib/apt/lists/*
COPY --from=wheel /wheel /wheel
RUN python3 -m venv /opt/build-fmu && /opt/build-fmu/bin/pip install --no-cache-dir /wheel/*.whl && rm -r /wheel
# a user without a home folder: caches of matplotlib
ENV PATH=/opt/build-fmu/bin:$PATH MPLCONFIGDIR=/tmp/matplotlib
WORKDIR /work
ENTRYPOINT ["build-fmu"]
