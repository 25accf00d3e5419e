# Builds Tactus on a bare Debian and runs the demo:
#   docker build -t tactus . && docker run --rm -v "$PWD/out:/tactus/out" tactus
# The pictures lie in out/ then. Any other command of the program:
#   docker run --rm tactus build/tactus info
FROM debian:12
RUN apt-get update && apt-get install -y --no-install-recommends git make ca-certificates && rm -rf /var/lib/apt/lists/*
WORKDIR /tactus
COPY tools/install_deps.sh tools/install_deps.sh
RUN tools/install_deps.sh && rm -rf /var/lib/apt/lists/*
COPY . .
RUN make build
CMD ["make", "demo"]
